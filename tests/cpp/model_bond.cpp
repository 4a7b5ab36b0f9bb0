#include "model/bond.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace
{
using mpm::model::BondedBar;
using mpm::model::forces_with_slip;

constexpr double infinite = std::numeric_limits<double>::infinity();

/// By how much forces exceed the strength of the bar or of its bonds.
double excess(const BondedBar& bar, const std::vector<double>& forces)
{
  double most = 0;
  for (std::size_t k = 0; k < forces.size(); ++k)
    most = std::max({most, bar.least[k] - forces[k], forces[k] - bar.largest[k]});
  for (std::size_t n = 0; n <= forces.size(); ++n)
  {
    const double before = n > 0 ? forces[n - 1] : 0, after = n < forces.size() ? forces[n] : 0;
    most = std::max(most, std::abs(after - before) - bar.bond_strength[n]);
  }
  return most;
}

double energy(const BondedBar& bar, const std::vector<double>& forces)
{
  double sum = 0;
  for (std::size_t k = 0; k < forces.size(); ++k)
    sum += (forces[k] - bar.force[k]) * (forces[k] - bar.force[k]) / (2 * bar.stiffness[k]);
  return sum;
}

TEST(Bond, HoldsABarUpToItsStrengthAndNoMore)
{
  const BondedBar weak{{3, 3}, {1, 1}, {-9, -9}, {9, 9}, {infinite, 1, 0.5}};
  EXPECT_EQ(forces_with_slip(weak), (std::vector<double>{1.5, 0.5}));
  const BondedBar strong{{3, 3}, {1, 1}, {-9, -9}, {9, 9}, {infinite, 1, 5}};
  EXPECT_EQ(forces_with_slip(strong), (std::vector<double>{3, 3}));
  const BondedBar free{{3, 2}, {1, 1}, {-9, -9}, {9, 9}, {infinite, 0, 0}};
  EXPECT_EQ(forces_with_slip(free), (std::vector<double>{0, 0}));
}

/// The energy is convex: forces are the nearest if no admissible ones beside them are nearer.
TEST(Bond, FindsTheNearestAdmissibleForces)
{
  std::mt19937 random(1);
  std::normal_distribution<> normal;
  std::uniform_real_distribution<> uniform(0.05, 1.5);
  for (int trial = 0; trial < 200; ++trial)
  {
    BondedBar bar;
    const std::size_t segments = 1 + random() % 6;
    for (std::size_t k = 0; k < segments; ++k)
    {
      bar.force.push_back(normal(random));
      bar.stiffness.push_back(uniform(random));
      bar.least.push_back(random() % 3 ? -uniform(random) : 0);
      bar.largest.push_back(random() % 3 ? infinite : uniform(random));
    }
    for (std::size_t n = 0; n <= segments; ++n)
      bar.bond_strength.push_back(0.5 * uniform(random));
    if (random() % 2)
      bar.bond_strength[0] = infinite;
    const std::vector<double> found = forces_with_slip(bar);
    ASSERT_LE(excess(bar, found), 1e-12);
    for (int other = 0; other < 500; ++other)
    {
      std::vector<double> beside = found;
      const double size = std::pow(10.0, -3 * uniform(random));
      const std::size_t first = random() % segments, last = first + random() % (segments - first);
      const double shift = random() % 2 ? size : -size; // of a group that slips together
      for (std::size_t k = first; k <= last; ++k)
        beside[k] += other % 2 ? shift : size * normal(random);
      if (excess(bar, beside) <= 1e-14)
      {
        ASSERT_GE(energy(bar, beside), energy(bar, found) - 1e-12);
      }
    }
  }
}
} // namespace
