#include "materials/laws/nor_sand.h"

#include "materials/laws/nor_sand_return.h"
#include "materials/tools/elasticity.h"

#include <numbers>

namespace mpm::materials
{
namespace
{
using namespace nor_sand;

constexpr double most_pressure = 1e100; ///< [Pa] beyond which squares and cubes might overflow

/// Whether an increment can be worked with: there is pressure, and it stays a number.
template <int D>
bool is_sound(const Start<D>& a, const Result<D>& r)
{
  return a.pressure > 0 && is_usable<D>(r.trial.deviator) && r.pressure < most_pressure && a.image > 0 &&
         a.image < most_pressure && std::isfinite(a.volume);
}

/// Whether the soil has opened so far that it only keeps the least pressure
template <int D>
bool is_loose(const Start<D>& a, const Result<D>& r)
{
  return r.pressure < a.least;
}

/// What a plastic result is differentiated by: the volumetric strain, or q or g of the trial at a fixed shear modulus
struct Change
{
  double volumetric = 0, q = 0, factor = 0;
};

/// @param inverse  of the Jacobian
template <int D>
SecantSlopes slopes(const Start<D>& a, const Result<D>& r, const Eigen::Matrix3d& inverse, const Change& by)
{
  const double m = r.multiplier, g = r.direction.factor, shear = r.trial.shear;
  const double psi = -a.volume * by.volumetric, slope = r.image.slope_by_psi * psi;
  const double hardening = a.law.hardening * std::exp(r.log - r.image.limit);
  const double excess = g * by.q / r.pressure + excess_by_factor(r) * by.factor - slope * (1 - r.log);
  const Eigen::Vector3d fixed{a.bulk * (m * slope * r.log - by.volumetric), m * hardening * r.image.limit_by_psi * psi,
                              r.vertex ? 0 : excess};
  const Eigen::Vector3d change = -(inverse * fixed);
  const double shear_change = a.law.rigidity * a.pressure * mean_growth_slope(r.growth) * change[0];
  if (r.vertex)
    return {r.pressure * change[0], shear_change, 0};
  // The ratio is 1 - 3 G g m / q
  const double q_change = by.q + q_by_shear<D>(r.trial, a.strain) * shear_change;
  const double factor_change = by.factor + factor_by_shear(a, r) * shear_change;
  const double strain = g * m, strain_change = factor_change * m + g * change[2] - strain * q_change / r.trial.q;
  return {r.pressure * change[0], shear_change, -3 * (shear_change * strain + shear * strain_change) / r.trial.q};
}

template <int D>
void write_tangent(const Start<D>& a, const Result<D>& r, bool plastic, double* tangent)
{
  if (is_loose(a, r)) // the one from which it closes again
    return write_secant_tangent<D>({a.law.rigidity * a.least, {}, 0}, {}, 1, {a.bulk * a.least, 0, 0}, {}, tangent);
  if (!plastic)
  {
    const double shear_by_volume = a.law.rigidity * a.pressure * mean_growth_slope(r.growth) * a.bulk;
    return write_secant_tangent<D>(r.trial, a.strain, 1, {r.pressure * a.bulk, shear_by_volume, 0}, {}, tangent);
  }
  const Eigen::Matrix3d inverse = jacobian(a, r).inverse();
  write_secant_tangent<D>(r.trial, a.strain, r.ratio(), slopes(a, r, inverse, {.volumetric = 1}),
                          slopes(a, r, inverse, {.q = 1}), tangent);
  if (r.vertex)
    return;
  const SecantSlopes by_factor = slopes(a, r, inverse, {.factor = 1});
  add_secant_tangent<D>(r.trial, a.strain, r.ratio(), by_factor, factor_by_deviator(a, r.trial, r.direction), tangent);
}

template <int D>
void write_point(const Start<D>& a, const Result<D>& r, const PointBatch<D>& points, Index i)
{
  const double ratio = is_loose(a, r) ? 0 : r.ratio(), pressure = std::max(r.pressure, a.least);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    points.stress[k][i] = ratio * r.trial.deviator[k] + (k < 3 ? a.law.attraction - pressure : 0.0);
  points.state[0][i] += r.vertex ? r.trial.q / (3 * r.trial.shear) : r.direction.factor * r.multiplier;
  points.state[1][i] += std::max(r.image_growth, std::min(std::log(a.least / a.image), 0.0));
  points.state[2][i] -= a.volumetric;
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
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    double* const tangent = points.tangent ? points.tangent + static_cast<std::size_t>(i) * entries : nullptr;
    const Start<D> a = start_of(law, points, i);
    Result<D> result = result_of(a, a.bulk * a.volumetric, 0, 0);
    bool sound = is_sound(a, result);
    const bool plastic = sound && excess(result) > 1e-11; // a returned stress counts as elastic
    if (plastic)
    {
      const auto found = result.log < 1 ? newton(a, result) : std::nullopt;
      result = found ? *found : bracketed(a);
      sound = std::isfinite(result.pressure + result.image_growth) && result.log < 1 + 1e-9 &&
              is_usable<D>(result.trial.deviator);
    }
    if (!sound)
    {
      report.failed.push_back(i);
      if (tangent)
        std::fill_n(tangent, entries, 0.0);
      continue;
    }
    report.plastic += plastic ? 1 : 0;
    write_point(a, result, points, i);
    if (tangent)
      write_tangent(a, result, plastic, tangent);
  }
  return report;
}

template BatchReport update<2>(const NorSand&, const PointBatch<2>&);
template BatchReport update<3>(const NorSand&, const PointBatch<3>&);
} // namespace mpm::materials
