#include "materials/laws/stiffness_groups.h"

#include <algorithm>
#include <numeric>

namespace mpm::materials
{
std::vector<int> stiffness_groups(std::span<const Law> laws)
{
  std::vector<double> moduli;
  for (const Law& law : laws)
    moduli.push_back(p_wave_modulus(law));
  std::vector<std::size_t> rising(laws.size());
  std::iota(rising.begin(), rising.end(), std::size_t{0});
  std::ranges::sort(rising, {}, [&](std::size_t law) { return moduli[law]; });
  std::vector<int> groups(laws.size());
  int group = -1;
  double softest = 0;
  for (const std::size_t law : rising)
  {
    if (group < 0 || moduli[law] > alike_in_stiffness * softest)
    {
      ++group;
      softest = moduli[law];
    }
    groups[law] = group;
  }
  return groups;
}
} // namespace mpm::materials
