#pragma once
/// @file
/// A model brought to another partition of its mesh.

#include "model/model.h"

namespace mpm::model
{
/// Replaces the model's mesh by the same one with another partition, and sends each particle to the rank that owns its
/// cell now. Moments of cells are summed again.
/// @param mesh    with the same cells, by their numbers over all ranks
/// @param owners  rank in this partition of each cell that this rank has owned so far
/// @post There are no boundary conditions; they must be set again, for the new nodes
/// @note Collective
template <class G, int D = G::dim>
void set_partition(Model<G>& model, const Mesh<D>& mesh, std::span<const GlobalIndex> owners);
} // namespace mpm::model
