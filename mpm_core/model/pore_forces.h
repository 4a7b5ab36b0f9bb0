#pragma once
/// @file
/// Forces of the pore pressures of the particles at the nodes.

#include "model/pore_water.h"
#include "model/velocity_field.h"

namespace mpm::model
{
/// Adds the internal forces of pore pressures, -B^T sum V_p p_p, to those of the stresses of a field; this rank's part.
/// Nothing where particles have no pore pressure, or water of its own velocity, which `water_to_nodes` looks after.
/// @pre the internal forces of the stresses have been integrated: with mixed integration the full cells are known
template <class G, int D = G::dim>
void add_pore_forces(const Mesh<D>& mesh, const Particles<D>& particles, const std::vector<Run>& runs,
                     VelocityField<G>& field);

/// Adds the forces of pressures on the surface of the soil to the tractions, those of standing water among them; this
/// rank's part. On facets between filled cells those from both sides cancel.
/// @param acting  which of the conditions: `&PressureCondition::presses`, or those that hold the pressure of the water
template <class G>
void add_surface_pressures(const Mesh<G::dim>& mesh, const PoreWater& water, bool PressureCondition::*acting,
                           VelocityField<G>& field);
} // namespace mpm::model
