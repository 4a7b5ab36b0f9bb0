#include "materials/laws/stiffness_groups.h"

#include "materials/laws/point_moduli.h"

#include <algorithm>
#include <cmath>

namespace mpm::materials
{
namespace
{
int stiffness_class(const Law& law)
{
  constexpr double reference_pressure = 100e3;
  const std::vector<double> initial_state(static_cast<std::size_t>(n_state(law)));
  const double modulus = moduli_of_point(law, -reference_pressure, initial_state).p_wave;
  return static_cast<int>(std::floor(std::log(modulus) / std::log(width_of_class)));
}
} // namespace

std::vector<int> stiffness_groups(std::span<const Law> laws)
{
  std::vector<int> groups;
  for (const Law& law : laws)
    groups.push_back(stiffness_class(law));
  std::vector<int> classes = groups;
  std::ranges::sort(classes);
  const auto repeated = std::ranges::unique(classes);
  classes.erase(repeated.begin(), repeated.end());
  for (int& group : groups)
    group = static_cast<int>(std::ranges::lower_bound(classes, group) - classes.begin());
  return groups;
}
} // namespace mpm::materials
