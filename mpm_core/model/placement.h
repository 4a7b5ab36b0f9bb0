#pragma once
/// @file
/// Particles put elsewhere by anything but a step.

#include "model/model.h"

namespace mpm::model
{
/// Gives particles new positions, searches their cells in the whole mesh, and sends them to the ranks that own
/// these. Initial positions stay as they are.
/// @param positions  [m], (n, D), one row for each particle of this rank in the present order
/// @throws InputError on all ranks, naming a particle that would be outside of the mesh; then no particle is changed
/// @post Particles may have another order, and other ranks
/// @note Collective
template <class G>
void place_particles(Model<G>& model, std::span<const double> positions);
} // namespace mpm::model
