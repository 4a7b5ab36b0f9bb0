#pragma once
/// @file
/// Dashpots of absorbing sides in steps that map velocities to the nodes twice (MUSL).

#include "model/model.h"

namespace mpm::explicit_scheme
{
/// Finds the cells beside dashpots, and by how much their forces change the velocity of the particles there: particles
/// share the accelerations of all nodes of their cell. Forces are taken in proportion to the areas of the nodes, as
/// those of plane waves are; others are overestimated, never underestimated, so that dashpots take energy out.
/// @note Collective
template <class G>
void prepare_dashpots(Model<G>& model);

/// Adds the forces of dashpots over a step to tractions and accelerations, by the mean velocities of the particles at
/// their nodes.
/// @param water  where it moves by itself, else null
/// @pre accelerations and velocity changes without dashpots have been found; the latter are stale afterwards
/// @note Collective
template <class G>
void add_dashpots(Model<G>& model, double pic_fraction, double dt, VelocityField<G>& field,
                  VelocityField<G>* water = nullptr);

/// Gives nodes of driven sides the velocity that their acceleration leads to, as boundary conditions do: that of the
/// ground.
template <class G>
void keep_driven_velocity(std::span<const DashpotNode<G::dim>> dashpots, double dt, VelocityField<G>& field);
} // namespace mpm::explicit_scheme
