/// What laws do with deviators: the Lode angle and its derivative, and the secant modulus of small increments.

#include "materials/tools/lode.h"
#include "materials/tools/secant.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

using namespace mpm::materials;
using mpm::base::SymTensor;

namespace
{
double q_of(const SymTensor<3>& s) { return std::sqrt(3.0) * radius<3>(s); }

/// A deviator with this Lode angle and q = 1 in principal axes, compression negative, rotated about z and then about x
SymTensor<3> rotated(double theta, double about_z, double about_x)
{
  const auto value = [&](int k) { return -2.0 / 3 * std::cos(theta - 2 * k * std::numbers::pi / 3); };
  const double c = std::cos(about_z), s = std::sin(about_z), d = std::cos(about_x), t = std::sin(about_x);
  const double xx = value(0) * c * c + value(1) * s * s, yy = value(0) * s * s + value(1) * c * c, zz = value(2);
  const double xy = (value(0) - value(1)) * c * s;
  return {xx, yy * d * d + zz * t * t, yy * t * t + zz * d * d, xy * d, (yy - zz) * d * t, xy * t};
}
} // namespace

TEST(Lode, CosineIsThatOfThePrincipalValuesInAnyAxes)
{
  for (const double degrees : {0.0, 1e-6, 10.0, 30.0, 45.0, 60.0})
    for (const double turn : {0.0, 0.4, 2.0})
    {
      const double theta = degrees * std::numbers::pi / 180;
      const SymTensor<3> s = rotated(theta, turn, 1.7 * turn);
      EXPECT_NEAR(q_of(s), 1, 1e-14);
      EXPECT_NEAR(lode_cosine<3>(s, 1), std::cos(3 * theta), 1e-14);
    }
  EXPECT_NEAR(lode_cosine<2>({-1, 1, 0, 3}, std::sqrt(30.0)), 0, 1e-14); // zz is the mean
  EXPECT_EQ(lode_cosine<3>({}, 0), 1);
}

TEST(Lode, SlopeIsTheDerivativeOfTheCosineAndAbsentInCompressionAndExtension)
{
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (int point = 0; point < 100; ++point)
  {
    SymTensor<3> s, change;
    for (std::size_t k = 0; k < 6; ++k)
    {
      s[k] = normal(random);
      change[k] = 1e-6 * normal(random);
    }
    s = deviator<3>(s);
    change = deviator<3>(change);
    SymTensor<3> more = s, less = s;
    for (std::size_t k = 0; k < 6; ++k)
    {
      more[k] += change[k];
      less[k] -= change[k];
    }
    const double q = q_of(s);
    const SymTensor<3> slope = lode_cosine_slope<3>(s, q, lode_cosine<3>(s, q));
    const double difference = lode_cosine<3>(more, q_of(more)) - lode_cosine<3>(less, q_of(less));
    EXPECT_NEAR(2 * product<3>(slope, change), difference, 1e-10);
    EXPECT_NEAR(mean<3>(slope), 0, 1e-13);
  }
  for (const double theta : {0.0, std::numbers::pi / 3})
    for (const double component : lode_cosine_slope<3>(rotated(theta, 0.3, 0.5), 1, std::cos(3 * theta)))
      EXPECT_NEAR(component, 0, 1e-14);
}

TEST(Secant, MeanGrowthIsExactWhereItsSeriesBeginsAndEnds)
{
  for (const double y : {1e-12, 1e-6, 1e-3, 0.0099, 0.0101, 0.5, 40.0})
    for (const double sign : {-1.0, 1.0})
      EXPECT_NEAR(mean_growth(sign * y), std::expm1(sign * y) / (sign * y), 4e-16 * std::max(1.0, std::exp(sign * y)));
  EXPECT_EQ(mean_growth(0), 1);
}
