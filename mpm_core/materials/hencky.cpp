#include "materials/hencky.h"

namespace mpm
{
std::vector<std::string> state_names(const Hencky& law)
{
  std::vector<std::string> names = state_names(law.law);
  names.push_back("log_volume");
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
    for (std::size_t k = 0; k < n; ++k)
      points.stress[k][i] *= std::exp(log_volume[i]);
  const BatchReport report = update<D>(law.law, points);
  const auto& strain = points.strain_increment;
  for (Index i = 0; i < points.size; ++i)
  {
    const double volumetric = strain[0][i] + strain[1][i] + strain[2][i];
    const double growth = volumetric > -1 && std::isfinite(volumetric) ? volumetric : 0.0; // else the point has failed
    log_volume[i] += std::log1p(growth);
    const double inverse = std::exp(-log_volume[i]);
    for (std::size_t k = 0; k < n; ++k)
      points.stress[k][i] *= inverse;
    if (!points.tangent)
      continue;
    double* const tangent = points.tangent + static_cast<std::size_t>(i) * n * n;
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t j = 0; j < n; ++j)
        tangent[k * n + j] = inverse * tangent[k * n + j] - (j < 3 ? points.stress[k][i] / (1 + growth) : 0.0);
  }
  return report;
}

template BatchReport update<2>(const Hencky&, const PointBatch<2>&);
template BatchReport update<3>(const Hencky&, const PointBatch<3>&);
} // namespace mpm
