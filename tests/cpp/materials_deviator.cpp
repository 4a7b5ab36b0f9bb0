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

double cosine_of(const SymTensor<3>& s) { return lode_cosine(-13.5 * determinant<3>(s), q_of(s)); }

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
      EXPECT_NEAR(cosine_of(s), std::cos(3 * theta), 1e-14);
    }
  EXPECT_EQ(determinant<2>({-1, 1, 0, 3}), 0); // zz is the mean
  EXPECT_EQ(lode_cosine(0.0, 0.0), 1);
}

TEST(Lode, ThirdOfAnAngleIsThatOfTheStandardLibrary)
{
  for (double cosine = -1; cosine <= 1; cosine += 1e-4)
    EXPECT_NEAR(third_cosine(cosine), std::cos(std::acos(cosine) / 3), 5e-16) << cosine;
  for (double beside = 1e-15; beside < 1e-3; beside *= 2) // where the arc cosine changes fast
    for (const double cosine : {1 - beside, beside - 1})
      EXPECT_NEAR(third_cosine(cosine), std::cos(std::acos(cosine) / 3), 5e-16) << beside;
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
    const SymTensor<3> slope = lode_cosine_slope<3>(s, q, cosine_of(s));
    EXPECT_NEAR(2 * product<3>(slope, change), cosine_of(more) - cosine_of(less), 1e-10);
    EXPECT_NEAR(mean<3>(slope), 0, 1e-13);
  }
  for (const double theta : {0.0, std::numbers::pi / 3})
    for (const double component : lode_cosine_slope<3>(rotated(theta, 0.3, 0.5), 1, std::cos(3 * theta)))
      EXPECT_NEAR(component, 0, 1e-14);
}

/// The invariants of deviators along a line against those of the deviators
template <int D>
void expect_invariants_along_lines()
{
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int line = 0; line < 100; ++line)
  {
    SymTensor<D> s, t, at;
    for (std::size_t k = 0; k < mpm::base::n_stress<D>; ++k)
    {
      s[k] = normal(random);
      t[k] = normal(random);
    }
    s = deviator<D>(s);
    t = deviator<D>(t);
    const double x = normal(random);
    for (std::size_t k = 0; k < mpm::base::n_stress<D>; ++k)
      at[k] = s[k] + x * t[k];
    const double scale = product<D>(s, s) + x * x * product<D>(t, t);
    EXPECT_NEAR(polynomial(square_along<D>(s, t), x), 3 * radius<D>(at) * radius<D>(at), 1e-14 * scale);
    EXPECT_NEAR(polynomial(cube_along<D>(s, t), x), -13.5 * determinant<D>(at), 1e-13 * std::pow(scale, 1.5));
  }
}

TEST(Lode, InvariantsAlongALineArePolynomials)
{
  expect_invariants_along_lines<2>();
  expect_invariants_along_lines<3>();
  const std::array<double, 4> cubic{7, 5, 3, 2};
  EXPECT_EQ(polynomial(cubic, 10.0), 2357);
  EXPECT_EQ(polynomial_slope(cubic, 10.0), 665);
}

TEST(Secant, GrowthIsExactWhereItsSeriesBeginsAndEnds)
{
  for (const double y : {0.0, 1e-12, 1e-6, 1e-3, 0.0499, 0.0501, 0.5, 40.0})
    for (const double sign : {-1.0, 1.0})
    {
      const Growth<double> growth = growth_of(sign * y);
      const double round_off = 4e-16 * std::max(1.0, std::exp(sign * y));
      EXPECT_NEAR(growth.factor, std::exp(sign * y), round_off);
      EXPECT_NEAR(growth.mean, y > 0 ? std::expm1(sign * y) / (sign * y) : 1, round_off);
      long double slope = 0, term = 1; // sum of y^k / (k! (k + 2))
      for (int k = 0; k < 20; term *= static_cast<long double>(sign * y) / ++k)
        slope += term / (k + 2);
      if (y >= 0.5)
        slope = (std::exp(sign * y) - std::expm1(sign * y) / (sign * y)) / (sign * y);
      EXPECT_NEAR(growth.slope, static_cast<double>(slope), std::max(round_off, 1e-14));
    }
}

TEST(Secant, GrowthOfAFewPointsIsThatOfEach)
{
  const mpm::base::Lanes y{1e-3, -0.2, 0, 3}; // small and large
  const Growth<mpm::base::Lanes> growth = growth_of(y);
  for (int l = 0; l < mpm::base::lanes; ++l)
  {
    const Growth<double> alone = growth_of(y[l]);
    EXPECT_EQ(growth.factor[l], alone.factor);
    EXPECT_EQ(growth.mean[l], alone.mean);
    EXPECT_EQ(growth.slope[l], alone.slope);
  }
}
