#pragma once
/// @file
/// A model brought to another partition of its mesh.

#include "model/model.h"

namespace mpm::model
{
/// Replaces the model's mesh by the same one cut otherwise, and sends each particle to the rank that owns its cell now.
/// Moments of cells are summed again.
/// @param mesh  with the same cells, by their numbers over all ranks
/// @post There are no boundary conditions; they must be set again, for the new nodes
/// @note Collective
template <class G, int D = G::dim>
void set_partition(Model<G>& model, const Mesh<D>& mesh);
} // namespace mpm::model
