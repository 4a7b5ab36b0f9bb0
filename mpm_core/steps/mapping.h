#pragma once
/// @file
/// What explicit and implicit steps take from the particles at their start, and the strains that nodes give the cells.

#include "steps/model.h"

namespace mpm
{
/// Sums of mass (11), momentum, internal force (14) and traction (15) at the nodes, over all ranks.
/// @pre prepare(model) has been called
/// @note Collective
template <int D>
void map_to_nodes(Model<D>& model);

/// v_i at the start of the step, from the sums at nodes, with supports.
template <int D>
void find_start_velocity(Model<D>& model);

/// Volumetric strains of the cells over dt [s] from the nodes' `velocity`, averaged over nodes (nodal mixed
/// discretisation).
/// @note Collective
template <int D>
void average_strains(Model<D>& model, double dt);
} // namespace mpm
