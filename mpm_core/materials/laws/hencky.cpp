#include "materials/laws/hencky.h"

#include <algorithm>
#include <limits>

namespace mpm::materials
{
namespace
{
/// Relative growth of a point's volume in the increment; above -1 where it can be worked with
template <int D>
double growth(const PointBatch<D>& points, Index i)
{
  const auto& strain = points.strain_increment;
  return strain[0][i] + strain[1][i] + strain[2][i];
}

/// Strains of a batch with NaN, for which every law fails, in the points that would lose their volume
template <int D>
std::array<std::vector<double>, n_stress<D>> refusing_strains(const PointBatch<D>& points)
{
  std::array<std::vector<double>, n_stress<D>> strains;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    const double* const column = points.strain_increment[k];
    strains[k].assign(column, column + points.size);
    for (Index i = 0; i < points.size; ++i)
      if (!(growth(points, i) > -1))
        strains[k][static_cast<std::size_t>(i)] = std::numeric_limits<double>::quiet_NaN();
  }
  return strains;
}

/// The law between Kirchhoff stresses and strains
template <int D>
BatchReport updated_law(const Hencky& law, PointBatch<D> points)
{
  bool sound = true;
  for (Index i = 0; i < points.size; ++i)
    sound &= growth(points, i) > -1;
  if (sound)
    return update<D>(law.law, points);
  const auto strains = refusing_strains(points);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    points.strain_increment[k] = strains[k].data();
  return update<D>(law.law, points);
}

/// Derivative of the Cauchy stress from that of the Kirchhoff stress
template <int D>
void write_tangent(const PointBatch<D>& points, Index i, double inverse, double growth)
{
  constexpr std::size_t n = n_stress<D>;
  double* const tangent = points.tangent + static_cast<std::size_t>(i) * n * n;
  for (std::size_t k = 0; k < n; ++k)
    for (std::size_t j = 0; j < n; ++j)
      tangent[k * n + j] = inverse * tangent[k * n + j] - (j < 3 ? points.stress[k][i] / (1 + growth) : 0.0);
}
} // namespace

std::vector<std::string> state_names(const Hencky& law)
{
  std::vector<std::string> names = state_names(law.law);
  names.emplace_back("log_volume");
  return names;
}

void check(const Hencky& law) { check(law.law); }

double p_wave_modulus(const Hencky& law) { return p_wave_modulus(law.law); }

template <int D>
BatchReport update(const Hencky& law, const PointBatch<D>& points)
{
  constexpr std::size_t n = n_stress<D>;
  double* const log_volume = points.state[n_state(law.law)];
  for (Index i = 0; i < points.size; ++i)
  {
    const double volume = std::exp(log_volume[i]);
    for (std::size_t k = 0; k < n; ++k)
      points.stress[k][i] *= volume;
  }
  BatchReport report = updated_law(law, points);
  auto failed = report.failed.begin();
  for (Index i = 0; i < points.size; ++i)
  {
    const bool has_failed = failed != report.failed.end() && *failed == i;
    failed += has_failed ? 1 : 0;
    log_volume[i] += has_failed ? 0.0 : std::log1p(growth(points, i));
    const double inverse = std::exp(-log_volume[i]);
    for (std::size_t k = 0; k < n; ++k)
      points.stress[k][i] *= inverse;
    if (points.tangent && !has_failed)
      write_tangent(points, i, inverse, growth(points, i));
  }
  return report;
}

template BatchReport update<2>(const Hencky&, const PointBatch<2>&);
template BatchReport update<3>(const Hencky&, const PointBatch<3>&);
} // namespace mpm::materials
