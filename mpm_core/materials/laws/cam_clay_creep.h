#pragma once
/// @file
/// The return of modified Cam-Clay with creep: two equations, solved by Newton's method, else by brackets.

#include "materials/laws/cam_clay_equations.h"
#include "materials/tools/root.h"

#include <optional>

namespace mpm::materials::cam_clay
{
/// The solution: the creep part x of the volumetric strain, and ln of z = m p, with the multiplier m of the flow
/// x = m (2 p - p_eq)
template <class N>
struct CreepAt
{
  N x, log_flow;
  N log_rate;     ///< ln of z at p_eq = p_c over the increment
  Mask<N> creeps; ///< false where no time has passed, or creep is below round-off
};

/// Changes by which the tangent is differentiated
template <class T>
struct CreepChanges
{
  T volumetric{}, q{}; ///< of the volumetric strain, and of q of the trial at a fixed shear modulus
};

template <class T>
struct CreepEnd
{
  T pressure, shear, ratio; ///< as in `Result`
  T flow;                   ///< the equations: x - z (1 - q^2 / (M^2 p^2)),
  T rate;                   ///< and ln of p_c by the rate over that of the history
};

template <class T>
T exponential(const T& x)
{
  using N = Number<T>;
  const N value = each(value_of(x), [](double number) { return falling_exponential(-number); });
  return chained(x, value, value);
}

template <class T>
CreepEnd<T> creep_end(const Start<Number<T>>& a, const Number<T>& log_rate, const T& x, const T& log_flow,
                      const CreepChanges<T>& changes = {})
{
  using N = Number<T>;
  const Clay& clay = a.clay;
  const T one = T{} + 1, y = a.elastic * (changes.volumetric - x + a.volumetric);
  const Exponential<T> growth = exponential_of<T>(y);
  const T pressure = a.pressure * growth.factor;
  const T shear = N(clay.shear_ratio * a.elastic * a.pressure) * growth.mean;
  const N double_shear = 2 * value_of(shear);
  const T along =
      chained(shear, polynomial<N>(a.square, double_shear), N(2 * polynomial_slope<N>(a.square, double_shear)));
  const T trial_q = square_root(positive_part(along)) + changes.q, z = exponential(log_flow);
  const T ratio = one / (6 / clay.slope_squared * shear * z / pressure + 1);
  const T stress_ratio = ratio * trial_q / pressure; // q / p
  const T slope = stress_ratio * stress_ratio / clay.slope_squared;
  const T of_rate = (log_flow - log_rate) / clay.exponent, hardening = a.plastic * x;
  return {pressure, shear, ratio, x - z * (one - slope),
          of_rate + hardening - y - logarithm(T(one + slope)) - logarithm<N>(a.pressure / a.preconsolidation)};
}

/// Creep strains below this are none [-].
inline constexpr double least_creep = 1e-18;

/// ln z of an isotropic stress, which the others are near to:
///     ln(z) / exponent + (v / kappa + v / (lambda - kappa)) z = c
template <class N>
N isotropic_flow(const Start<N>& a, const Result<N>& trial, const N& log_rate)
{
  const double exponent = a.clay.exponent;
  const N slope = trial.square / (a.clay.slope_squared * trial.pressure * trial.pressure);
  const N c = log_rate / exponent + logarithm<N>(trial.pressure / a.preconsolidation) + logarithm<N>(1 + slope);
  const N softness = a.elastic + a.plastic;
  N l = smaller<N>(exponent * c, logarithm<N>(larger<N>(c, N{} + 1e-3) / softness)); // from here on it converges
  for (int iteration = 0; iteration < 6; ++iteration)
  {
    const N z = softness * exponential<N>(l);
    l = l - (l / exponent + z - c) / (1 / exponent + z);
  }
  return l;
}

/// Newton's method from the isotropic solution
/// @returns where it converges, or where there is no creep
template <class N>
Mask<N> creep_newton(const Start<N>& a, CreepAt<N>& at)
{
  constexpr int most = 30;
  Mask<N> open = at.creeps;
  for (int iteration = 0; iteration < most && any(open); ++iteration)
  {
    const auto end = creep_end<Dual<2, N>>(a, at.log_rate, variable<2>(at.x, 0), variable<2>(at.log_flow, 1));
    const auto& [fx, fl] = end.flow.slopes;
    const auto& [rx, rl] = end.rate.slopes;
    const N determinant = fx * rl - fl * rx;
    const N dx = (fl * end.rate.value - rl * end.flow.value) / determinant;
    const N dl = (rx * end.flow.value - fx * end.rate.value) / determinant;
    at.x = at.x + chosen<N>(open, dx, N{});
    at.log_flow = at.log_flow + chosen<N>(open, larger<N>(smaller<N>(dl, N{} + 2), N{} - 5), N{});
    open = open & !((absolute<N>(a.elastic * dx) < 1e-12) & (absolute(dl) < 1e-9));
  }
  return !open;
}

/// x that satisfies the equation of the flow at a given z
inline double strain_at(const Start<double>& a, double log_rate, double log_flow)
{
  const auto excess = [&](double x) { return creep_end<double>(a, log_rate, x, log_flow).flow; };
  const double most = std::exp(log_flow);
  double least = -1e-3 * most;
  while (excess(least) > 0 && least > -10)
    least *= 4;
  return root_between(excess, {least, excess(least)}, {most, excess(most)});
}

/// The same by brackets around a guess; false where there is no solution
inline bool creep_by_brackets(const Start<double>& a, CreepAt<double>& at, double guess)
{
  const double log_rate = at.log_rate;
  const auto excess = [&](double l) { return creep_end<double>(a, log_rate, strain_at(a, log_rate, l), l).rate; };
  double low = guess - 1, high = guess + 1;
  while (excess(low) > 0 && low > guess - 1000)
    low -= 2 * (guess - low);
  while (excess(high) < 0 && high < 5)
    high += 1;
  const Sample first{low, excess(low)}, last{high, excess(high)};
  if (!(first.f <= 0 && last.f >= 0))
    return false;
  at.log_flow = root_between(excess, first, last);
  at.x = strain_at(a, log_rate, at.log_flow);
  return true;
}

/// Nothing where a point has no solution, or one of a few by brackets only
/// @param dt  duration of the increment [s]
template <class N>
std::optional<CreepAt<N>> creep_solution(const Start<N>& a, const Result<N>& trial, double dt)
{
  const N volume = a.elastic * a.clay.swelling;
  const N rate = dt * a.clay.creep_per_time / volume + std::numeric_limits<double>::min(); // of no time too
  const N log_rate = logarithm<N>(rate), guess = isotropic_flow(a, trial, log_rate);
  CreepAt<N> at{exponential<N>(guess), guess, log_rate, guess > std::log(least_creep)};
  const Mask<N> found = creep_newton(a, at);
  if (!any(!found))
    return at;
  if constexpr (std::is_same_v<N, double>)
    if (creep_by_brackets(a, at, guess))
      return at;
  return {};
}

template <class N>
Result<N> creep_result(const Start<N>& a, const CreepAt<N>& at)
{
  const N pressure = a.pressure * growth_of<N>(a.elastic * (a.volumetric - at.x)).factor;
  const N multiplier = exponential<N>(at.log_flow) / pressure;
  return result_of<N>(a, chosen<N>(at.creeps, at.x, N{}), chosen<N>(at.creeps, multiplier, N{}));
}

/// Derivatives of the new stress by the strain that changes the volume, and by q of the trial
inline std::array<SecantSlopes, 2> creep_slopes(const Start<double>& a, const CreepAt<double>& at)
{
  using T = Dual<4>;
  const double x_at = at.creeps ? at.x : 0.0, log_flow = at.creeps ? at.log_flow : -600.0;
  const CreepEnd<T> end = creep_end<T>(a, at.log_rate, variable<4>(x_at, 0), variable<4>(log_flow, 1),
                                       {variable<4>(0.0, 2), variable<4>(0.0, 3)});
  const auto &f = end.flow.slopes, &r = end.rate.slopes;
  const double determinant = f[0] * r[1] - f[1] * r[0];
  const auto slopes = [&](std::size_t by)
  {
    const double x = at.creeps ? (f[1] * r[by] - r[1] * f[by]) / determinant : 0.0;
    const double l = at.creeps ? (r[0] * f[by] - f[0] * r[by]) / determinant : 0.0;
    const double per_strain = by == 2 ? 1 - a.volumetric : 1.0; // which is a logarithm
    const auto total = [&](const T& number)
    { return per_strain * (number.slopes[by] + number.slopes[0] * x + number.slopes[1] * l); };
    return SecantSlopes{total(end.pressure), total(end.shear), total(end.ratio)};
  };
  return {slopes(2), slopes(3)};
}
} // namespace mpm::materials::cam_clay
