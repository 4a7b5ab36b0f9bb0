#include "materials/laws/cam_clay.h"

#include "materials/laws/cam_clay_creep.h"
#include "materials/tools/lode.h"
#include "materials/tools/root.h"
#include "materials/tools/side_by_side.h"

namespace mpm::materials
{
namespace
{
using namespace cam_clay;

Clay clay_of(const CamClay& law)
{
  return {3 * (1 - 2 * law.poisson) / (2 * (1 + law.poisson)),
          law.critical_slope * law.critical_slope,
          law.swelling,
          law.compression - law.swelling,
          1 + law.void_ratio,
          law.preconsolidation + law.attraction,
          law.attraction,
          law.creep > 0 ? (law.compression - law.swelling) / law.creep : 0.0,
          law.creep / law.reference_time};
}

/// The two equations of a return, linearised: flow, x = m (2 p - p_c), and yield = 0
template <class T>
struct Linearised
{
  T ratio_by_y, ratio_by_m;
  T yield_by_y; ///< at a fixed p_c
  T flow_by_x, flow_by_m, yield_by_x, yield_by_m;

  /// Changes of x and m by which the equations change by these
  std::array<T, 2> solve(const T& flow, const T& yield) const
  {
    const T determinant = flow_by_x * yield_by_m - flow_by_m * yield_by_x;
    return {(flow * yield_by_m - flow_by_m * yield) / determinant,
            (flow_by_x * yield - yield_by_x * flow) / determinant};
  }
};

template <class T>
Linearised<T> linearised(const Start<T>& a, const Result<T>& r)
{
  const T &m = r.multiplier, &p = r.pressure, &pc = r.preconsolidation;
  const T square_by_y = 2 * polynomial_slope<T>(a.square, 2 * r.shear) * r.shear_by_y;
  const T per_slope = 1 / (T{} + a.clay.slope_squared), per_yield = 1 / (a.preconsolidation * a.preconsolidation);
  const T by_modulus = -6 * r.ratio * r.ratio * per_slope;
  const T ratio_by_y = by_modulus * m * r.shear_by_y, ratio_by_m = by_modulus * r.shear;
  const T by_ratio = 2 * r.ratio * r.square * per_slope;
  const T yield_by_y =
      (r.ratio * r.ratio * square_by_y * per_slope + by_ratio * ratio_by_y + (2 * p - pc) * p) * per_yield;
  return {ratio_by_y,
          ratio_by_m,
          yield_by_y,
          1 + m * (2 * p * a.elastic + pc * a.plastic),
          pc - 2 * p,
          -yield_by_y * a.elastic - p * pc * a.plastic * per_yield,
          by_ratio * ratio_by_m * per_yield};
}

/// Newton's method from the elastic result; false where it does not find a result that makes sense. With m above 0,
/// that is between x = 0 and the critical state.
/// @param yields  of a few points those that yield; the others stay elastic
template <class T>
bool newton(const Start<T>& a, Result<T>& r, const Mask<T>& yields)
{
  constexpr double tolerance = 1e-13;
  for (int iteration = 0; iteration < 15; ++iteration)
  {
    const T flow = r.x - r.multiplier * (2 * r.pressure - r.preconsolidation);
    const Mask<T> is_open = yields & !((absolute(r.yield) <= tolerance) & (absolute<T>(a.elastic * flow) <= tolerance));
    if (!any(is_open))
      return !any(Mask<T>(yields & !(r.multiplier > 0)));
    const auto [x, m] = linearised(a, r).solve(flow, r.yield);
    r = result_of<T>(a, r.x - (is_open ? x : T{}), r.multiplier - (is_open ? m : T{}));
  }
  return false;
}

/// The same by brackets. Between x = 0 and the x at which the critical state is reached, 2 p = p_c, the multiplier
/// m = x / (2 p - p_c) rises from 0 to infinity, and the deviator falls from the trial one to 0: between them the yield
/// function has its root. The unknown is the fraction of that x.
Result<double> bracketed(const Start<double>& a)
{
  const double sum = a.elastic + a.plastic;
  const double critical = (std::log(2 * a.pressure / a.preconsolidation) + a.elastic * a.volumetric) / sum;
  const auto at = [&](double fraction)
  {
    const double x = critical * fraction, left = 1 - fraction;
    const double pc = a.preconsolidation * std::exp(a.plastic * x);
    return result_of(a, x, fraction / (left * pc * sum * growth_of(sum * critical * left).mean));
  };
  return at(root_between([&](double s) { return at(s).yield; }, {0, at(0).yield}, {1, -1}));
}

/// Derivatives of a result
/// @param volumetric, trial_q  change of the volumetric strain, and of q of the trial at a fixed shear modulus
SecantSlopes slopes(const Start<double>& a, const Result<double>& r, bool plastic, double volumetric, double trial_q)
{
  double dx = 0, dm = 0, ratio_by_y = 0, ratio_by_m = 0;
  if (plastic)
  {
    const Linearised<double> linear = linearised(a, r);
    const double flow = 2 * r.multiplier * r.pressure * a.elastic * volumetric;
    const double by_q = 2 * r.ratio * r.ratio * std::sqrt(std::max(r.square, 0.0)) /
                        (a.clay.slope_squared * a.preconsolidation * a.preconsolidation);
    const double yield = -linear.yield_by_y * a.elastic * volumetric - by_q * trial_q;
    const auto change = linear.solve(flow, yield);
    dx = change[0];
    dm = change[1];
    ratio_by_y = linear.ratio_by_y;
    ratio_by_m = linear.ratio_by_m;
  }
  const double dy = a.elastic * (volumetric - dx);
  return {r.pressure * dy, r.shear_by_y * dy, ratio_by_y * dy + ratio_by_m * dm};
}

template <int D, class T>
Start<T> start_of(const Clay& clay, const PointBatch<D>& points, Index i, Deviators<D, T>& deviators)
{
  const auto [stress, strain] = tensors_of<D, T>(points, i);
  deviators = {deviator<D>(stress), deviator<D>(strain)};
  const auto exponential = [&](std::size_t k)
  { return each(load_as<T>(points.state[k] + i), [](double x) { return std::exp(x); }); };
  const T volume = clay.volume * exponential(2), log_volume = 3 * mean<D>(strain);
  return {clay,
          volume / clay.swelling,
          volume / clay.difference,
          clay.attraction - mean<D>(stress),
          clay.preconsolidation * exponential(1),
          -log_volume * growth_of<T>(log_volume).mean,
          log_volume,
          square_along<D>(deviators.stress, deviators.strain)};
}

/// Whether an increment can be worked with: there is pressure, and it stays a number.
template <class T>
Mask<T> is_sound(const Start<T>& a, const Result<T>& trial)
{
  constexpr double most = 1e100; // [Pa] beyond which squares and cubes might overflow
  return (a.pressure > 0) & (trial.pressure < most) & (trial.square < most * most) & (a.preconsolidation > 0) &
         (a.preconsolidation < most) & (absolute(a.log_volume) < 1);
}

/// Whether an elastic result lies outside of the yield surface; a stress that was returned does not.
template <class T>
Mask<T> yields(const Result<T>& trial)
{
  return trial.yield > 1e-12;
}

/// The pressure that soil keeps, over the preconsolidation pressure of the law's start. Without any it would have no
/// stiffness, and round-off of the attraction less the stress would leave it without a next increment.
constexpr double least_pressure = 1e-4;

template <int D, class T>
void write(const Start<T>& a, const Result<T>& r, const Deviators<D, T>& deviators, const PointBatch<D>& points,
           Index i)
{
  const T least = T{} + least_pressure * a.clay.preconsolidation;
  write_stress<D, T>(points, i, a.clay.attraction - larger(r.pressure, least), r.ratio, r.shear, deviators);
  const T q = root(larger(r.square, T{}));
  add_to_state<D, T>(points, i, 0, 2 * r.multiplier * r.ratio * q / a.clay.slope_squared);
  const T softest = (T{} + std::log(2 * least_pressure)) - load_as<T>(points.state[1] + i); // critical at that pressure
  add_to_state<D, T>(points, i, 1, larger(a.plastic * r.x, softest));
  add_to_state<D, T>(points, i, 2, a.log_volume);
}

/// Whether soil creeps in increments of this duration
bool creeps(const Clay& clay, double dt) { return clay.creep_per_time > 0 && std::isfinite(dt); }

/// Whether a point flows faster than at its preconsolidation pressure
template <class N>
Mask<N> flows(const CreepAt<N>& at)
{
  return at.creeps & (at.log_flow > at.log_rate);
}

/// An increment of soil that creeps
template <int D>
Outcome creep_point(const Start<double>& a, const Result<double>& trial, const Deviators<D, double>& deviators,
                    const PointBatch<D>& points, Index i, double* tangent)
{
  const std::optional<CreepAt<double>> at = creep_solution(a, trial, points.dt);
  if (!at)
    return Outcome::failed;
  const Result<double> result = creep_result(a, *at);
  write(a, result, deviators, points, i);
  if (tangent)
  {
    const auto [by_volume, by_q] = creep_slopes(a, *at);
    write_secant_tangent<D>(secant_trial<D>(result.shear, deviators.stress, deviators.strain), deviators.strain,
                            result.ratio, by_volume, by_q, tangent);
  }
  return flows(*at) ? Outcome::plastic : Outcome::elastic;
}

/// The same for a few points
template <int D>
std::optional<Index> creep_points(const Start<Lanes>& a, const Result<Lanes>& trial,
                                  const Deviators<D, Lanes>& deviators, const PointBatch<D>& points, Index i)
{
  const std::optional<CreepAt<Lanes>> at = creep_solution(a, trial, points.dt);
  if (!at)
    return {};
  write(a, creep_result(a, *at), deviators, points, i);
  return count(flows(*at));
}

template <int D>
Outcome update_point(const Clay& clay, const PointBatch<D>& points, Index i, double* tangent)
{
  Deviators<D, double> deviators;
  const Start<double> a = start_of(clay, points, i, deviators);
  const Result<double> trial = result_of(a, 0.0, 0.0);
  if (!is_sound(a, trial))
    return Outcome::failed;
  if (creeps(clay, points.dt))
    return creep_point(a, trial, deviators, points, i, tangent);
  Result<double> result = trial;
  const bool plastic = yields(trial);
  if (plastic && !newton(a, result, true))
    result = bracketed(a);
  write(a, result, deviators, points, i);
  if (tangent)
    write_secant_tangent<D>(secant_trial<D>(result.shear, deviators.stress, deviators.strain), deviators.strain,
                            result.ratio, slopes(a, result, plastic, 1 - a.volumetric, 0),
                            slopes(a, result, plastic, 0, 1), tangent);
  return plastic ? Outcome::plastic : Outcome::elastic;
}

template <int D>
std::optional<Index> update_points(const Clay& clay, const PointBatch<D>& points, Index i)
{
  Deviators<D, Lanes> deviators;
  const Start<Lanes> a = start_of(clay, points, i, deviators);
  Result<Lanes> result = result_of(a, Lanes{}, Lanes{});
  if (any(!is_sound(a, result)))
    return {};
  if (creeps(clay, points.dt))
    return creep_points(a, result, deviators, points, i);
  const LaneMask plastic = yields(result);
  if (any(plastic) && !newton(a, result, plastic))
    return {};
  write(a, result, deviators, points, i);
  return count(plastic);
}
} // namespace

double p_wave_modulus(const CamClay& law)
{
  const double bulk = (1 + law.void_ratio) * (2 * law.preconsolidation + law.attraction) / law.swelling;
  return 3 * bulk * (1 - law.poisson) / (1 + law.poisson);
}

double shear_modulus(const CamClay& law)
{
  const double bulk = (1 + law.void_ratio) * (law.preconsolidation + law.attraction) / law.swelling;
  return 3 * bulk * (1 - 2 * law.poisson) / (2 * (1 + law.poisson));
}

template <int D>
BatchReport update(const CamClay& law, const PointBatch<D>& points)
{
  const Clay clay = clay_of(law);
  return update_side_by_side(
      points, [&](Index i) { return update_points(clay, points, i); },
      [&](Index i, double* tangent) { return update_point(clay, points, i, tangent); });
}

template BatchReport update<2>(const CamClay&, const PointBatch<2>&);
template BatchReport update<3>(const CamClay&, const PointBatch<3>&);
} // namespace mpm::materials
