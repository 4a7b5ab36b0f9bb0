#pragma once
/// @file
/// What inertia and local damping amount to over a step of any length.
///
/// The explicit scheme damps by D = alpha |R| sign(v), R = f_ext - f_int. What that does to a body depends on whether a
/// step resolves the small elastic oscillations at the scale of the mesh, of angular frequency omega.
///
/// **Resolved**, omega dt << 1: R held over the step moves the node by m dv/dt = R - alpha |R| sign(v), that is, with
/// the apparent mass m / (1 - alpha) while it gains speed and m / (1 + alpha) while it loses speed. Where the velocity
/// changes its sign within the step, D changes with it, so the momentum that R must give is
///
///     R dt = m [ (w - v0) / (1 + alpha) + (v1 - w) / (1 - alpha) ],   w = v1 clipped to between 0 and v0.
///
/// This is r(v1) = R - D - m (v1 - v0) / dt = 0 with D the mean over the step, solved for R: continuous and increasing
/// in v1, where sign(v1) would make the residual jump. With alpha = 0 it is plain backward Euler.
///
/// **Not resolved**, omega dt >> 1: of the oscillation R' = m a', v' the step knows nothing, backward Euler having
/// taken it away; but its mean effect on the slow motion v stays. For a sine, and for Gaussian noise, whose v' and a'
/// are not correlated at one time,
///
///     < alpha |R'| sign(v + v') > = alpha (2/pi) omega m v + O(v^3),   omega = rms(a') / rms(v'),
///
/// while |v| is not above rms(v'): a viscous drag, which is what makes a damped explicit slide creep.
///
/// A step of backward Euler leaves 1 / (1 + (omega dt)^2) of the energy of an oscillation. That fraction of D is taken
/// as resolved, and the rest as not. Steps of second order are for motion without damping.

#include <algorithm>
#include <numbers>

namespace mpm::implicit
{
/// g: length of each stage of a step of second order, over that of the step.
inline constexpr double stage_fraction = 1 - 0.5 * std::numbers::sqrt2;

/// Inertia force of one component, with what local damping adds to it, and its derivative by v1.
struct Inertia
{
  double force;      ///< [N]
  double derivative; ///< [N s/m]
};

/// @param frequency  omega of the node [rad/s]
/// @param resolved   energy of an oscillation that the step leaves, over that at its start
inline Inertia damped_inertia(double mass, double v0, double v1, double dt, double alpha, double frequency,
                              double resolved)
{
  const double drag = alpha * (1 - resolved) * 2 * std::numbers::inv_pi * frequency * mass;
  alpha *= resolved;
  const double w = std::clamp(v1, std::min(0.0, v0), std::max(0.0, v0));
  const double slowed = mass / dt / (1 + alpha), sped = mass / dt / (1 - alpha);
  return {slowed * (w - v0) + sped * (v1 - w) + drag * v1, (v1 == w && v1 != v0 ? slowed : sped) + drag};
}

/// Energy of an oscillation that a step of backward Euler leaves, over that at its start; x = omega dt.
inline double left_by_backward_euler(double x) { return 1 / (1 + x * x); }
} // namespace mpm::implicit
