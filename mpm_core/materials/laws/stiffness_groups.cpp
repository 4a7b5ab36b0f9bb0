#include "materials/laws/stiffness_groups.h"

#include "materials/laws/point_moduli.h"

#include <algorithm>
#include <numeric>

namespace mpm::materials
{
namespace
{
double p_wave_modulus(const Law& law)
{
  constexpr double reference_pressure = 100e3;
  const std::vector<double> initial_state(static_cast<std::size_t>(n_state(law)));
  return moduli_of_point(law, -reference_pressure, initial_state).p_wave;
}
} // namespace

std::vector<int> stiffness_groups(std::span<const Law> laws)
{
  std::vector<double> moduli;
  for (const Law& law : laws)
    moduli.push_back(p_wave_modulus(law));
  std::vector<std::size_t> by_stiffness(laws.size());
  std::iota(by_stiffness.begin(), by_stiffness.end(), std::size_t{0});
  std::ranges::sort(by_stiffness, {}, [&](std::size_t law) { return moduli[law]; });
  std::vector<int> groups(laws.size());
  double softest = 0, last = 0; // moduli of the present group
  int group = -1;
  for (std::size_t law : by_stiffness)
  {
    if (!(moduli[law] <= largest_step_in_group * last && moduli[law] <= largest_range_of_group * softest))
    {
      ++group;
      softest = moduli[law];
    }
    last = moduli[law];
    groups[law] = group;
  }
  return groups;
}
} // namespace mpm::materials
