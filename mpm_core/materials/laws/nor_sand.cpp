#include "materials/laws/nor_sand.h"

#include "materials/laws/nor_sand_return.h"
#include "materials/tools/side_by_side.h"

#include <numbers>

namespace mpm::materials
{
namespace
{
using namespace nor_sand;

constexpr double most_pressure = 1e100; ///< [Pa] beyond which squares and cubes might overflow
const double log_most_pressure = std::log(most_pressure);
constexpr double round_off = 1e-11; ///< of the excess: a returned stress counts as elastic

template <int D, class T>
Start<T> start_of(const Sand& sand, const PointBatch<D>& points, Index i, Deviators<D, T>& deviators)
{
  const auto [stress, strain] = tensors_of<D, T>(points, i);
  deviators = {deviator<D>(stress), deviator<D>(strain)};
  const T pressure = sand.attraction - mean<D>(stress), volumetric = -3 * mean<D>(strain);
  const T image_growth = load_as<T>(points.state[1] + i), log_image = sand.log_image + image_growth;
  const T log_volume = load_as<T>(points.state[2] + i) - volumetric;
  const T volume = sand.volume * each(log_volume, [](double x) { return std::exp(x); });
  return {sand,
          pressure,
          log_image,
          each(pressure, [](double x) { return std::log(x); }) - log_image,
          volumetric,
          volume,
          volume + sand.psi + sand.compression * image_growth,
          square_along<D>(deviators.stress, deviators.strain),
          {}};
}

/// Whether an increment can be worked with: there is pressure, and it stays a number.
template <class T>
Mask<T> is_sound(const Start<T>& a, const Result<T>& r)
{
  return (a.pressure > 0) & (r.trial.q < most_pressure) & (r.pressure < most_pressure) &
         (absolute(a.log_image) < log_most_pressure) & (absolute(a.psi) < most_pressure);
}

/// Whether the soil has opened so far that it only keeps the least pressure
template <class T>
Mask<T> is_loose(const Start<T>& a, const Result<T>& r)
{
  return r.pressure < a.sand.least;
}

/// What a plastic result is differentiated by: the volumetric strain, or q or g of the trial at a fixed shear modulus
struct Change
{
  double volumetric = 0, q = 0, factor = 0;
};

/// A plastic result with the derivatives of its equations
struct Linearised
{
  double most; ///< p_max / p_i
  GrowthSlopes<double> by_growth;
  Unknowns<double> log; ///< derivatives of z
  Jacobian<double> jacobian;
};

Linearised linearised(const Start<double>& a, const Result<double>& r)
{
  const double most = most_per_image(r);
  const GrowthSlopes<double> by_growth = growth_slopes(a, r);
  return {most, by_growth, log_slopes(a, r), jacobian(a, r, most, by_growth)};
}

SecantSlopes slopes(const Start<double>& a, const Result<double>& r, const Linearised& linear, const Change& by)
{
  const auto& [most, by_growth, log, jacobian] = linear;
  const double m = r.multiplier, g = r.trial.factor;
  const double psi = -a.volume * by.volumetric, slope = r.image.slope_by_psi * psi;
  const double z = a.sand.bulk * (by.volumetric - m * slope * r.log) / r.scale; // and so that of y
  const double excess = g * by.q / r.pressure + excess_by_factor(r) * by.factor - slope * (1 - r.log) +
                        (by_growth.excess + r.image.slope) * z;
  const Unknowns<double> change =
      jacobian.solve({m * a.sand.hardening * most * (z - r.image.limit_by_psi * psi), r.vertex ? -z : -excess});
  // y = z + L - ln(p / p_i) of the start
  const double growth = z + (1 + log.image_growth) * change.image_growth + log.multiplier * change.multiplier;
  const double pressure_change = r.pressure * growth, shear_change = r.trial.shear_by_growth * growth;
  if (r.vertex)
    return {pressure_change, shear_change, 0};
  // The ratio is 1 - 3 G g m / q
  const double q_change = by.q + by_growth.q * growth, factor_change = by.factor + by_growth.factor * growth;
  const double strain = g * m;
  const double strain_change = factor_change * m + g * change.multiplier - strain * q_change / r.trial.q;
  return {pressure_change, shear_change, -3 * (shear_change * strain + r.trial.shear * strain_change) / r.trial.q};
}

template <int D>
void write_tangent(const Start<double>& a, const Result<double>& r, bool plastic, const Deviators<D, double>& deviators,
                   double* tangent)
{
  const Sand& sand = a.sand;
  if (is_loose(a, r)) // the one from which it closes again
    return write_secant_tangent<D>({sand.rigidity * sand.least, {}, 0}, {}, 1, {sand.bulk * sand.least, 0, 0}, {},
                                   tangent);
  const SecantTrial<D> trial = secant_trial<D>(r.trial.shear, deviators.stress, deviators.strain);
  const SymTensor<D>& strain = deviators.strain;
  if (!plastic)
  {
    const SecantSlopes by_volume{r.pressure * sand.bulk, r.trial.shear_by_growth * sand.bulk, 0};
    return write_secant_tangent<D>(trial, strain, 1, by_volume, {}, tangent);
  }
  const Linearised linear = linearised(a, r);
  write_secant_tangent<D>(trial, strain, r.ratio(), slopes(a, r, linear, {.volumetric = 1}),
                          slopes(a, r, linear, {.q = 1}), tangent);
  if (r.vertex)
    return;
  SymTensor<D> factor_by_deviator = lode_cosine_slope<D>(trial.deviator, trial.q, r.trial.lode);
  for (double& component : factor_by_deviator)
    component *= factor_by_lode(sand, r.trial.factor);
  add_secant_tangent<D>(trial, strain, r.ratio(), slopes(a, r, linear, {.factor = 1}), factor_by_deviator, tangent);
}

template <int D, class T>
void write(const Start<T>& a, const Result<T>& r, const Deviators<D, T>& deviators, const PointBatch<D>& points,
           Index i)
{
  const T mean = a.sand.attraction - larger(r.pressure, T{} + a.sand.least);
  write_stress(points, i, mean, is_loose(a, r) ? T{} : r.ratio(), r.trial.shear, deviators);
  add_to_state(points, i, 0, r.vertex ? r.trial.q / (3 * r.trial.shear) : r.trial.factor * r.multiplier);
  add_to_state(points, i, 1, larger(r.image_growth, smaller(a.sand.log_least - a.log_image, T{})));
  add_to_state(points, i, 2, -a.volumetric);
}

template <int D>
Outcome update_point(const Sand& sand, const PointBatch<D>& points, Index i, double* tangent)
{
  Deviators<D, double> deviators;
  Start<double> a = start_of(sand, points, i, deviators);
  Result<double> result = undirected_result(a, 0.0, 0.0);
  bool sound = is_sound(a, result), plastic = false;
  if (sound && may_yield(sand, result))
  {
    a.cube = cube_along<D>(deviators.stress, deviators.strain);
    set_direction(a, result.trial);
    plastic = excess(result) > round_off;
  }
  if (plastic)
  {
    if (!(result.log < 1 && newton(a, result, true)))
      result = bracketed(a);
    sound = std::isfinite(result.pressure + result.image_growth + result.trial.q) && result.log < 1 + 1e-9;
  }
  if (!sound)
    return Outcome::failed;
  write(a, result, deviators, points, i);
  if (tangent)
    write_tangent(a, result, plastic, deviators, tangent);
  return plastic ? Outcome::plastic : Outcome::elastic;
}

/// Updates a few points side by side, each of which rounds as it does alone.
/// @return the number of those that yielded; nothing, and no point is changed, where one is not sound or needs brackets
template <int D>
std::optional<Index> update_points(const Sand& sand, const PointBatch<D>& points, Index i)
{
  Deviators<D, Lanes> deviators;
  Start<Lanes> a = start_of(sand, points, i, deviators);
  Result<Lanes> result = undirected_result(a, Lanes{}, Lanes{});
  if (any(!is_sound(a, result)))
    return {};
  LaneMask plastic{};
  if (any(may_yield(sand, result)))
  {
    a.cube = cube_along<D>(deviators.stress, deviators.strain);
    set_direction(a, result.trial);
    plastic = excess(result) > round_off;
    if (any(plastic) && (any(plastic & (result.log >= 1)) || !newton(a, result, plastic)))
      return {};
  }
  write(a, result, deviators, points, i);
  return count(plastic);
}
} // namespace

double bulk_per_pressure(const NorSand& law)
{
  return law.rigidity * 2 * (1 + law.poisson) / (3 * (1 - 2 * law.poisson));
}

double p_wave_modulus(const NorSand& law)
{
  const double pressure = 2 * std::numbers::e * (law.image_pressure + law.attraction) - law.attraction;
  return (bulk_per_pressure(law) + 4.0 / 3 * law.rigidity) * pressure;
}

double shear_modulus(const NorSand& law) { return law.rigidity * (law.image_pressure + law.attraction); }

template <int D>
BatchReport update(const NorSand& law, const PointBatch<D>& points)
{
  const Sand sand = sand_of(law);
  return update_side_by_side(
      points, [&](Index i) { return update_points(sand, points, i); },
      [&](Index i, double* tangent) { return update_point(sand, points, i, tangent); });
}

template BatchReport update<2>(const NorSand&, const PointBatch<2>&);
template BatchReport update<3>(const NorSand&, const PointBatch<3>&);
} // namespace mpm::materials
