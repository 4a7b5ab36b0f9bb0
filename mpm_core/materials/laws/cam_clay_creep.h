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
struct CreepAt
{
  double x = 0, log_flow = 0;
  double log_rate = 0; ///< ln of z at p_eq = p_c over the increment
  bool creeps = false; ///< false where no time has passed, or creep is below round-off
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
  T square;                 ///< q^2 of the trial
  T flow, rate; ///< the equations: x - z (1 - q^2 / (M^2 p^2)), and ln of p_c of the rate over that of the history
};

template <class T>
T exponential(const T& x)
{
  const auto value = std::exp(value_of(x));
  return chained(x, Number<T>(value), value);
}

template <class T>
CreepEnd<T> creep_end(const Start<double>& a, double log_rate, const T& x, const T& log_flow,
                      const CreepChanges<T>& changes = {})
{
  const Clay& clay = a.clay;
  const T y = a.elastic * (a.volumetric + changes.volumetric - x);
  const Exponential<T> growth = exponential_of<T>(y);
  const T pressure = a.pressure * growth.factor;
  const T shear = clay.shear_ratio * a.elastic * a.pressure * growth.mean;
  const double double_shear = 2 * value_of(shear);
  const T along =
      chained(shear, polynomial<double>(a.square, double_shear), 2 * polynomial_slope<double>(a.square, double_shear));
  const T trial_q = square_root(positive_part(along)) + changes.q, square = trial_q * trial_q;
  const T z = exponential(log_flow);
  const T ratio = T(1.0) / (1.0 + 6 / clay.slope_squared * shear * z / pressure);
  const T slope = ratio * ratio * square / (clay.slope_squared * pressure * pressure); // (q / (M p))^2
  const T hardening = a.plastic * x;
  return {pressure,
          shear,
          ratio,
          square,
          x - z * (1.0 - slope),
          (log_flow - log_rate) / clay.exponent - std::log(a.pressure / a.preconsolidation) - y + hardening -
              logarithm(T(1.0 + slope))};
}

/// Creep strains below this are none [-].
inline constexpr double least_creep = 1e-18;

/// z of an isotropic stress, which the others are near to: ln(z) / exponent + (v / kappa + v / (lambda - kappa)) z = c
inline double isotropic_flow(const Start<double>& a, const Result<double>& trial, double log_rate)
{
  const double slope = trial.square / (a.clay.slope_squared * trial.pressure * trial.pressure);
  const double c = log_rate / a.clay.exponent + std::log(trial.pressure / a.preconsolidation) + std::log1p(slope);
  const double softness = a.elastic + a.plastic;
  double l =
      std::min(a.clay.exponent * c, std::log(std::max(c, 1e-3) / softness)); // on the side from which it converges
  for (int iteration = 0; iteration < 8; ++iteration)
  {
    const double z = softness * std::exp(l);
    l -= (l / a.clay.exponent + z - c) / (1 / a.clay.exponent + z);
  }
  return l;
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

/// The same by brackets
inline std::optional<CreepAt> bracketed_creep(const Start<double>& a, double log_rate, double guess)
{
  const auto excess = [&](double l) { return creep_end<double>(a, log_rate, strain_at(a, log_rate, l), l).rate; };
  double low = guess - 1, high = guess + 1;
  while (excess(low) > 0 && low > guess - 1000)
    low -= 2 * (guess - low);
  while (excess(high) < 0 && high < 5)
    high += 1;
  const Sample first{low, excess(low)}, last{high, excess(high)};
  if (!(first.f <= 0 && last.f >= 0))
    return {};
  const double l = root_between(excess, first, last);
  return CreepAt{strain_at(a, log_rate, l), l, log_rate, true};
}

/// Nothing where there is no solution
/// @param dt  duration of the increment [s]
inline std::optional<CreepAt> creep_solution(const Start<double>& a, const Result<double>& trial, double dt)
{
  constexpr int most = 30;
  const double volume = a.elastic * a.clay.swelling, rate = dt * a.clay.creep_per_time / volume;
  if (!(rate > 0))
    return CreepAt{};
  const double log_rate = std::log(rate), guess = isotropic_flow(a, trial, log_rate);
  if (guess < std::log(least_creep))
    return CreepAt{};
  CreepAt at{std::exp(guess), guess, log_rate, true};
  for (int iteration = 0; iteration < most; ++iteration)
  {
    const auto end = creep_end<Dual<2>>(a, log_rate, variable<2>(at.x, 0), variable<2>(at.log_flow, 1));
    const auto& [fx, fl] = end.flow.slopes;
    const auto& [rx, rl] = end.rate.slopes;
    const double determinant = fx * rl - fl * rx;
    const double dx = (fl * end.rate.value - rl * end.flow.value) / determinant;
    const double dl = (rx * end.flow.value - fx * end.rate.value) / determinant;
    if (!(std::abs(dx) < 1 && std::abs(dl) < 1e6))
      break;
    at.x += dx;
    at.log_flow += std::clamp(dl, -5.0, 2.0);
    if (std::abs(a.elastic * dx) < 1e-12 && std::abs(dl) < 1e-9)
      return at;
  }
  return bracketed_creep(a, log_rate, guess);
}

inline Result<double> creep_result(const Start<double>& a, const CreepAt& at)
{
  const double pressure = creep_end<double>(a, at.log_rate, at.x, at.log_flow).pressure;
  return result_of(a, at.x, std::exp(at.log_flow) / pressure);
}

/// Derivatives of the new stress by the volumetric strain, and by q of the trial
inline std::array<SecantSlopes, 2> creep_slopes(const Start<double>& a, const CreepAt& at)
{
  using T = Dual<4>;
  const double log_flow = at.creeps ? at.log_flow : -1e3;
  const CreepEnd<T> end = creep_end<T>(a, at.log_rate, variable<4>(at.x, 0), variable<4>(log_flow, 1),
                                       {variable<4>(0.0, 2), variable<4>(0.0, 3)});
  const auto &f = end.flow.slopes, &r = end.rate.slopes;
  const double determinant = f[0] * r[1] - f[1] * r[0];
  const auto slopes = [&](std::size_t by)
  {
    const double x = at.creeps ? (f[1] * r[by] - r[1] * f[by]) / determinant : 0.0;
    const double l = at.creeps ? (r[0] * f[by] - f[0] * r[by]) / determinant : 0.0;
    const auto total = [&](const T& number) { return number.slopes[by] + number.slopes[0] * x + number.slopes[1] * l; };
    return SecantSlopes{total(end.pressure), total(end.shear), total(end.ratio)};
  };
  return {slopes(2), slopes(3)};
}
} // namespace mpm::materials::cam_clay
