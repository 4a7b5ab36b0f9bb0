#pragma once
/// @file
/// The pass over the resting cells in a step: strains, stresses and nodal forces of linear finite elements.

#include "model/particle_pass.h"

namespace mpm::model
{
/// Moves resting cells with their nodes, whose gains their rows learn of later, strains them, updates their stresses,
/// and sums the forces of these at the nodes, for the next step.
template <class G>
void resting_pass(Model<G>& model, const PassOptions& options);
} // namespace mpm::model
