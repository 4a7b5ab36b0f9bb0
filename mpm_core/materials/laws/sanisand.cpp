#include "materials/laws/sanisand.h"

#include "materials/laws/sanisand_equations.h"
#include "materials/tools/chebyshev.h"
#include "materials/tools/elasticity.h"
#include "materials/tools/root.h"
#include "materials/tools/rotation.h"
#include "materials/tools/side_by_side.h"

namespace mpm::materials
{
namespace
{
using namespace sanisand;

constexpr double tolerance = 1e-5;   ///< error of a substep, of p and s over p, of alpha, and of z over its limit
constexpr int most_substeps = 10000; ///< of an increment
constexpr int most_stages = 200;     ///< of a substep
constexpr double on_surface = 1e-10; ///< distance in ratios of stress from the yield surface that counts as none

constexpr std::array components{"xx", "yy", "zz", "xy", "yz", "xz"};
constexpr std::size_t first_back = 2, first_reversal = 8, first_fabric = 14; ///< columns of the states

/// A substep: its length as a fraction of the plastic part of an increment, and its stages
struct Substep
{
  double part;
  int stages;
};

/// The substeps of an increment, so that they can be taken once more
struct Schedule
{
  std::vector<Substep> substeps;
  bool is_given = false;
};

/// A point at the start of an increment
template <int D>
struct Start
{
  Point<D> point;
  Increment<D> increment;
};

template <int D>
SymTensor<D> tensor_state(const PointBatch<D>& points, Index i, std::size_t first)
{
  SymTensor<D> tensor;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    tensor[k] = points.state[first + k][i];
  return tensor;
}

template <int D>
Start<D> start_of(const Sand& sand, const PointBatch<D>& points, Index i, const SymTensor<D>& stress,
                  const Strain<D>& strain)
{
  const auto turned = [&](std::size_t first)
  {
    const SymTensor<D> tensor = tensor_state(points, i, first);
    if (!points.deformation.front())
      return tensor;
    Matrix<D> f;
    for (std::size_t k = 0; k < D * D; ++k)
      f[k / D][k % D] = points.deformation[k][i];
    return rotated<D>(rotation_of<D>(f), tensor);
  };
  const double pressure = sand.law.attraction - mean<D>(stress);
  const bool is_loose = pressure < sand.least;
  Point<D> point;
  point.pressure = is_loose ? sand.least : pressure; // NaN stays
  point.deviator = is_loose ? SymTensor<D>{} : deviator<D>(stress);
  point.back = turned(first_back);
  point.fabric = turned(first_fabric);
  point.plastic = points.state[0][i];
  return {point, {strain, (1 + sand.law.void_ratio) * std::exp(points.state[1][i]), turned(first_reversal)}};
}

/// Puts alpha where the yield surface passes through a stress beyond it.
template <int D>
void put_back(const Sand& sand, Point<D>& point)
{
  const SymTensor<D> beyond = from_back<D>(point);
  const double length = norm<D>(beyond), gap = length - sand.radius;
  if (gap > 0)
    point.back = sum<D>(point.back, gap / length, beyond);
}

/// Fraction of an increment that is elastic
template <int D>
double elastic_fraction(const Sand& sand, const Increment<D>& increment, const ElasticPath<D>& path, double least_root)
{
  const auto beyond = [&](double fraction)
  { return norm<D>(from_back<D>(path.at(fraction, least_root))) - sand.radius; };
  Sample first{0, beyond(0)};
  if (first.f > -on_surface)
  {
    const Loading<D> at = loading<D>(sand, path.start, increment.void_ratio(0));
    if (load(at, increment.strain, sand.bulk) > 0)
      return 0;
  }
  const Sample last{1, beyond(1)};
  if (!(last.f > on_surface))
    return 1;
  for (double x = 0.5; !(first.f < -on_surface); x *= 0.5) // from the surface inwards and out again
  {
    if (x < 1e-12)
      return 0;
    first = {x, beyond(x)};
  }
  return root_between(beyond, first, last);
}

/// Keeps the least pressure, at the ratio of stress that a point had before.
template <int D>
void keep_pressure(const Sand& sand, const Point<D>& before, Point<D>& point)
{
  if (!(point.pressure < sand.least))
    return;
  point.pressure = sand.least;
  point.deviator = scaled<D>(sand.least / before.pressure, before.deviator);
}

/// Error of a substep, relative to the pressure and to the limit of the fabric.
/// Source: Sommeijer, Shampine, Verwer (1998), eq. (2.13)
template <int D>
double error_of(const Sand& sand, const Point<D>& start, const Point<D>& rate, const Point<D>& end,
                const Point<D>& rate_there, double step)
{
  const Point<D> error =
      by_number([step](double y0, double y1, double r0, double r1) { return 0.8 * (y0 - y1) + 0.4 * step * (r0 + r1); },
                start, end, rate, rate_there);
  const double stress = std::max(std::abs(error.pressure), norm<D>(error.deviator)) / end.pressure;
  return std::max({stress, norm<D>(error.back), norm<D>(error.fabric) / std::max(sand.law.fabric_limit, 1.0)});
}

/// Takes the plastic part of an increment in substeps, with control of their error.
/// @return whether it came to the end
template <int D>
bool advance(const Sand& sand, Increment<D>& increment, Point<D>& point, Schedule& schedule)
{
  const double rest = 1 - point.fraction;
  const auto rates_at = [&](const Point<D>& at) { return rates<D>(sand, increment, at); };
  double done = 0, part = 1;
  std::size_t accepted = 0;
  if (product<D>(from_back<D>(point), sum<D>(point.back, -1, increment.reversal)) < 0)
    increment.reversal = point.back;
  Point<D> rate = rates_at(point);
  for (int substeps = 0; done < 1; ++substeps)
  {
    if (substeps == most_substeps)
      return false;
    int stages = chebyshev_stages(part * rest * stiffness_of_rates<D>(sand, increment, point));
    if (stages > most_stages)
    {
      part *= 0.9 * most_stages * most_stages / (static_cast<double>(stages) * stages);
      stages = most_stages;
    }
    if (schedule.is_given)
    {
      part = schedule.substeps[accepted].part;
      stages = schedule.substeps[accepted].stages;
    }
    const double step = part * rest;
    Point<D> end = chebyshev_step(point, rate, step, stages, rates_at,
                                  [&](Point<D>& stage) { keep_pressure<D>(sand, point, stage); });
    put_back<D>(sand, end);
    Point<D> rate_there = rates_at(end);
    const double error = error_of<D>(sand, point, rate, end, rate_there, step);
    if (!std::isfinite(error))
      return false;
    const double growth = std::clamp(0.8 * std::cbrt(tolerance / std::max(error, 1e-300)), 0.1, 4.0);
    if (error <= tolerance || schedule.is_given)
    {
      if (!schedule.is_given)
        schedule.substeps.push_back({part, stages});
      done = ++accepted == schedule.substeps.size() && schedule.is_given ? 1 : done + part;
      point = end;
      if (product<D>(from_back<D>(point), sum<D>(point.back, -1, increment.reversal)) < 0)
      {
        increment.reversal = point.back;
        rate_there = rates_at(point);
      }
      rate = rate_there;
    }
    part = std::min(part * growth, 1 - done);
  }
  return true;
}

/// Takes a point through an increment. Soil that has never been loaded has its last reversal at its stress.
template <int D>
bool integrate(const Sand& sand, Increment<D>& increment, Point<D>& point, Schedule& schedule)
{
  const bool is_new = point.plastic == 0 && product<D>(point.back, point.back) == 0;
  put_back<D>(sand, point);
  if (is_new)
    increment.reversal = point.back;
  const ElasticPath<D> path(sand, point, increment.strain, increment.void_ratio(0.5));
  const double least_root = std::sqrt(sand.least), elastic = elastic_fraction(sand, increment, path, least_root);
  point = path.at(elastic, least_root);
  return elastic == 1 || advance(sand, increment, point, schedule);
}

template <int D>
SymTensor<D> stress_of(const Sand& sand, const Point<D>& point)
{
  SymTensor<D> stress = point.deviator;
  for (std::size_t k = 0; k < 3; ++k)
    stress[k] += sand.law.attraction - point.pressure;
  return stress;
}

template <int D>
Strain<D> strain_of(const SymTensor<D>& strain)
{
  return {deviator<D>(strain), -3 * mean<D>(strain)};
}

/// Writes the tangent by central differences of the same substeps; that of a point that is not strained is elastic.
template <int D>
bool write_tangent(const Sand& sand, const Start<D>& start, const SymTensor<D>& strain, Schedule& schedule,
                   double* tangent)
{
  constexpr std::size_t n = n_stress<D>;
  constexpr double step = 1e-9;
  if (product<D>(strain, strain) == 0)
  {
    const double shear = shear_modulus(sand.law, start.point.pressure, start.increment.void_ratio(0));
    const auto elastic = elastic_tangent<D>({(sand.bulk - 2.0 / 3) * shear, shear});
    std::copy(elastic.begin(), elastic.end(), tangent);
    return true;
  }
  schedule.is_given = !schedule.substeps.empty();
  for (std::size_t j = 0; j < n; ++j)
  {
    std::array<SymTensor<D>, 2> ends;
    for (const double sign : {-1.0, 1.0})
    {
      SymTensor<D> changed = strain;
      changed[j] += sign * (j < 3 ? step : 0.5 * step);
      auto [point, increment] = start;
      increment.strain = strain_of<D>(changed);
      if (!integrate(sand, increment, point, schedule))
        return false;
      ends[sign > 0] = stress_of<D>(sand, point);
    }
    for (std::size_t k = 0; k < n; ++k)
      tangent[k * n + j] = (ends[1][k] - ends[0][k]) / (2 * step);
  }
  return true;
}

template <int D>
Outcome update_point(const Sand& sand, const PointBatch<D>& points, Index i, Schedule& schedule, double* tangent)
{
  const auto [stress, strain] = tensors_of<D>(points, i);
  const Start<D> start = start_of<D>(sand, points, i, stress, strain_of<D>(strain));
  auto [point, increment] = start;
  schedule.substeps.clear();
  schedule.is_given = false;
  if (!is_usable<D>(stress) || !is_usable<D>(strain) || !integrate(sand, increment, point, schedule))
    return Outcome::failed;
  const SymTensor<D> result = stress_of<D>(sand, point);
  if (!is_usable<D>(result) || !is_usable<D>(point.back) || !is_usable<D>(point.fabric) ||
      !std::isfinite(point.plastic + increment.void_ratio(1)))
    return Outcome::failed;
  if (tangent && !write_tangent<D>(sand, start, strain, schedule, tangent))
    return Outcome::failed;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    points.stress[k][i] = result[k];
    points.state[first_back + k][i] = point.back[k];
    points.state[first_reversal + k][i] = increment.reversal[k];
    points.state[first_fabric + k][i] = point.fabric[k];
  }
  points.state[0][i] = point.plastic;
  points.state[1][i] -= increment.strain.volumetric;
  return point.plastic > start.point.plastic ? Outcome::plastic : Outcome::elastic;
}
} // namespace

std::vector<std::string> state_names(const Sanisand&)
{
  std::vector<std::string> names{"plastic_strain", "log_specific_volume"};
  for (const char* tensor : {"back_stress_ratio_", "reversal_stress_ratio_", "fabric_"})
    for (const char* component : components)
      names.emplace_back(tensor).append(component);
  return names;
}

void check(const Sanisand& law) { check_parameters(law); }

double bulk_per_shear(const Sanisand& law) { return 2 * (1 + law.poisson) / (3 * (1 - 2 * law.poisson)); }

double shear_modulus(const Sanisand& law, double pressure, double void_ratio)
{
  return shear_per_root(law, void_ratio) * std::sqrt(std::max(pressure, Sanisand::least_pressure));
}

double shear_modulus(const Sanisand& law)
{
  return shear_modulus(law, law.largest_pressure + law.attraction, law.void_ratio);
}

double p_wave_modulus(const Sanisand& law) { return (bulk_per_shear(law) + 4.0 / 3) * shear_modulus(law); }

template <int D>
BatchReport update(const Sanisand& law, const PointBatch<D>& points)
{
  const Sand sand = sand_of(law);
  Schedule schedule;
  return update_side_by_side(
      points, [](Index) { return std::optional<Index>{}; },
      [&](Index i, double* tangent) { return update_point<D>(sand, points, i, schedule, tangent); });
}

template BatchReport update<2>(const Sanisand&, const PointBatch<2>&);
template BatchReport update<3>(const Sanisand&, const PointBatch<3>&);
} // namespace mpm::materials
