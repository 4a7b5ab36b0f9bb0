#pragma once
/// @file
/// What inertia and local damping amount to over a step of any length.

#include <algorithm>

namespace mpm
{
/// Inertia force of one component and its derivative by v1.
struct Inertia
{
  double force;      ///< [N]
  double derivative; ///< [N s/m]
};

/// Inertia with the local damping D = alpha |R| sign(v) of the explicit scheme in it.
///
/// Backward Euler takes the out-of-balance force R = f_ext - f_int at the step's end. Held over the step, it moves
/// the node by m dv/dt = R - alpha |R| sign(v), that is, with the apparent mass m / (1 - alpha) while it gains speed
/// and m / (1 + alpha) while it loses speed. Where the velocity changes its sign within the step, D changes with it, so
/// the momentum that R must give is
///
///     R dt = m [ (w - v0) / (1 + alpha) + (v1 - w) / (1 - alpha) ],   w = v1 clipped to between 0 and v0.
///
/// This is r(v1) = R - D - m (v1 - v0) / dt = 0 with D the mean over the step, solved for R: continuous and increasing
/// in v1, where sign(v1) would make the residual jump. With alpha = 0 it is plain backward Euler; for small steps it is
/// the explicit D.
inline Inertia damped_inertia(double mass, double v0, double v1, double dt, double alpha)
{
  const double w = std::clamp(v1, std::min(0.0, v0), std::max(0.0, v0));
  const double slowed = mass / dt / (1 + alpha), sped = mass / dt / (1 - alpha);
  return {slowed * (w - v0) + sped * (v1 - w), v1 == w && v1 != v0 ? slowed : sped};
}
} // namespace mpm
