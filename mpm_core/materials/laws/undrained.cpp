#include "materials/laws/undrained.h"

namespace mpm::materials
{
std::vector<std::string> state_names(const Undrained& law)
{
  std::vector<std::string> names = state_names(law.skeleton);
  names.emplace_back("excess_pore_pressure");
  return names;
}

void check(const Undrained& law)
{
  check(law.skeleton);
  check_parameters(law);
}

double p_wave_modulus(const Undrained& law) { return p_wave_modulus(law.skeleton) + law.water_modulus / law.porosity; }

template <int D>
BatchReport update(const Undrained& law, const PointBatch<D>& points)
{
  constexpr std::size_t n = n_stress<D>;
  const double stiffness = law.water_modulus / law.porosity;
  double* const pressure = points.state[n_state(law.skeleton)];
  for (std::size_t k = 0; k < 3; ++k)
    for (Index i = 0; i < points.size; ++i)
      points.stress[k][i] += pressure[i];
  BatchReport report = update<D>(law.skeleton, points);
  const auto& strain = points.strain_increment;
  auto failed = report.failed.begin();
  for (Index i = 0; i < points.size; ++i)
  {
    const bool has_failed = failed != report.failed.end() && *failed == i;
    failed += has_failed ? 1 : 0;
    pressure[i] -= has_failed ? 0.0 : stiffness * (strain[0][i] + strain[1][i] + strain[2][i]);
    for (std::size_t k = 0; k < 3; ++k)
      points.stress[k][i] -= pressure[i];
    for (std::size_t k = 0; points.tangent && k < 9; ++k)
      points.tangent[static_cast<std::size_t>(i) * n * n + k / 3 * n + k % 3] += stiffness;
  }
  return report;
}

template BatchReport update<2>(const Undrained&, const PointBatch<2>&);
template BatchReport update<3>(const Undrained&, const PointBatch<3>&);
} // namespace mpm::materials
