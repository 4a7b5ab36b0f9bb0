#pragma once
/// @file
/// What explicit and implicit steps take from the particles at their start, and the strains that nodes give the cells.

#include "steps/model.h"

#include <cmath>

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

/// What the nodes add to the velocities of particles over dt [s]: dt a_i, and with a PIC share that much of the grid's
/// velocity, which takes the place of the particles' own.
template <int D>
void find_velocity_change(Model<D>& model, double pic_share, double dt);

/// Volumetric strains of the nodes over dt [s] from the nodes' `velocity`, averages over the cells around them
/// (nodal mixed discretisation).
/// @note Collective
template <int D>
void average_strains(Model<D>& model, double dt);

/// Averages the mean of the normal components in the plane of the cells' stress times volume, as strains are averaged.
///
/// The forces of these stresses do the work of the particles' stresses on averaged strains: with volume weights the
/// average is its own transpose.
/// @param stress  of each owned cell [N m]
/// @note Collective
template <int D>
void average_stresses(Model<D>& model, std::span<std::array<double, n_symmetric<D>>> stress);

/// Local damping of FLAC for one component: alpha |R| sign(v).
///
/// Where v is less than a tenth of the change that R makes of it in a step, the damping passes linearly through zero
/// instead of jumping: a node that a wave has just reached has a residual while its velocity is still round-off, and a
/// sign taken from round-off would let results depend on the order of summation, so on the number of ranks.
/// @param change  R dt / m_i, what R makes of the velocity in a step [m/s]
inline double local_damping(double alpha, double residual, double velocity, double change)
{
  const double width = 0.1 * std::abs(change);
  return std::abs(velocity) < width ? alpha * std::abs(residual) * (velocity / width)
                                    : std::copysign(alpha * std::abs(residual), velocity);
}
} // namespace mpm
