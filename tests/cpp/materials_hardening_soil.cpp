/// The return of Hardening Soil: Newton's method against brackets, and its derivatives against differences.

#include "materials/laws/hardening_soil_return.h"

#include <gtest/gtest.h>

#include <random>

using namespace mpm::materials;
using namespace mpm::materials::hardening_soil;
using mpm::base::SymTensor;

namespace
{
const HardeningSoil law{30e6, 30e6, 90e6, 5e3, 32, 6};
const Soil soil = soil_of(law);

/// A random stress of pressures around 50 kPa within the strength, which has hardened to some degree, and a random
/// strain increment of some size
Start<double> random_start(std::mt19937& random, double size)
{
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  SymTensor<3> stress, strain;
  for (std::size_t k = 0; k < 6; ++k)
  {
    stress[k] = normal(random);
    strain[k] = size * normal(random);
  }
  SymTensor<3> s = deviator<3>(stress);
  const SymTensor<3> e = deviator<3>(strain);
  const double pressure = 20e3 + 60e3 * uniform(random), mobilised = 0.95 * uniform(random);
  const double unit = std::sqrt(square_along<3>(s, e)[0]);
  const Direction<double> direction = direction_of(soil, lode_cosine(-13.5 * determinant<3>(s), unit));
  const double smallest = pressure / (1 + direction.smallest * soil.slope * mobilised / direction.difference);
  for (double& component : s)
    component *= soil.slope * mobilised * smallest / (direction.difference * unit);
  const double cap = 10e3 + 100e3 * uniform(random);
  return {pressure,
          smallest,
          softness_of(soil, smallest),
          mobilised,
          4e-3 * uniform(random),
          cap,
          std::log(cap / soil.cap),
          cap_compliance(soil, cap),
          size * normal(random),
          square_along<3>(s, e),
          cube_along<3>(s, e)};
}
} // namespace

TEST(HardeningSoil, NewtonFindsWhatBracketsFind)
{
  std::mt19937 random(1);
  int compared = 0, by_brackets = 0, loose = 0;
  for (const double size : {1e-5, 1e-4, 1e-3, 1e-2})
    for (int point = 0; point < 1000; ++point)
    {
      const Start<double> start = random_start(random, size);
      const auto found = newton_solution(soil, start, elastic_end<double>(soil, start, 0));
      const auto expected = bracketed(soil, start);
      ASSERT_TRUE(expected);
      if (!found)
      {
        ++by_brackets;
        continue;
      }
      ++compared;
      loose += expected->is_loose;
      EXPECT_EQ(found->is_loose, expected->is_loose);
      EXPECT_NEAR(found->at.log_stress, expected->at.log_stress, 1e-6);
      const auto &one = found->end, &other = expected->end;
      EXPECT_NEAR(one.q, other.q, 1e-6 * (1e3 + other.q));
      EXPECT_NEAR(one.plastic, other.plastic, 1e-9 + 1e-6 * other.plastic);
      EXPECT_LT(std::abs(one.deviatoric), 1e-11);
      if (!found->is_loose)
      {
        EXPECT_LT(std::abs(one.volumetric), 1e-11);
      }
    }
  EXPECT_GT(compared, 3960);
  EXPECT_LT(by_brackets, 40);
  EXPECT_GT(loose, 10);
}

TEST(HardeningSoil, DerivativesAreThoseByDifferences)
{
  std::mt19937 random(2);
  for (int point = 0; point < 200; ++point)
  {
    const Start<double> start = random_start(random, 1e-3);
    const std::array<double, 5> at{0.3, 0.6, 0, 0, 0};
    const auto end_at = [&](const std::array<double, 5>& x) {
      return end_of<double>(soil, start, {x[0], x[1]}, {x[2], x[3], x[4]});
    };
    using T = Dual<5>;
    const End<T> end = end_of<T>(soil, start, {variable<5>(at[0], 0), variable<5>(at[1], 1)},
                                 {variable<5>(0.0, 2), variable<5>(0.0, 3), variable<5>(0.0, 4)});
    constexpr std::array step{1e-6, 1e-6, 1e-8, 1e-1, 1e-7};
    for (std::size_t k = 0; k < 5; ++k)
    {
      std::array<double, 5> more = at, less = at;
      more[k] += step[k];
      less[k] -= step[k];
      const auto slope = [&](double End<double>::*number)
      { return (end_at(more).*number - end_at(less).*number) / (2 * step[k]); };
      const auto compare = [&](double found, double expected)
      { EXPECT_NEAR(found, expected, 1e-4 * std::abs(expected) + 1e-9 / step[k]); };
      compare(end.pressure.slopes[k], slope(&End<double>::pressure));
      compare(end.volumetric.slopes[k], slope(&End<double>::volumetric));
      compare(end.deviatoric.slopes[k], slope(&End<double>::deviatoric));
      compare(end.shear_modulus.slopes[k], slope(&End<double>::shear_modulus));
    }
  }
}
