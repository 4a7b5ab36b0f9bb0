#pragma once
/// @file
/// The time steps up to which explicit steps are stable, by the waves that cross the cells.

#include "model/material_points.h"

#include <limits>

namespace mpm::explicit_scheme
{
/// The particle of this rank whose h_min / c_d is smallest.
struct CriticalParticle
{
  Index particle = -1;                                           ///< its row, -1 where there is none
  double altitude = 0;                                           ///< h_min of its cell [m]
  double squared_time = std::numeric_limits<double>::infinity(); ///< (h_min / c_d)^2 [s2]
};

/// Finds it; c_d as in `critical_time_step`.
template <class G>
CriticalParticle critical_particle(const Model<G>& model);

/// Critical time step (16): the smallest of h_min / c_d over the particles and resting cells, c_d = sqrt((K + 4G/3) /
/// rho_p); with water that has its own velocity that of the fast wave. [s]
/// @note Collective
template <class G>
double critical_time_step(const Model<G>& model);

/// The critical step of cells together with that of structural members: squares of frequencies add up. [s]
/// @param critical  of the cells
/// @param squared_frequency  see `squared_frequency_of_members`
double critical_with_members(double critical, double squared_frequency);

/// The same of the stresses and the mass of the soil alone where its water has a velocity of its own, which bounds the
/// damping by viscous stresses; else `critical_time_step`. [s]
/// @note Collective
template <class G>
double critical_time_step_of_soil(const Model<G>& model);
} // namespace mpm::explicit_scheme
