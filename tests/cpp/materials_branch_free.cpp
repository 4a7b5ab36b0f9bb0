/// Elementary functions of vector loops against those of the standard library.

#include "materials/tools/branch_free.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace mpm::materials;

TEST(BranchFree, ExponentialFallsToRoundOff)
{
  EXPECT_EQ(falling_exponential(0), 1);
  for (double x = 1e-12; x < 700; x *= 1.003)
    EXPECT_NEAR(falling_exponential(x) / std::exp(-x), 1, 5e-16) << x;
  for (double x = -1e-12; x > -700; x *= 1.003)
    EXPECT_NEAR(falling_exponential(x) / std::exp(-x), 1, 5e-16) << x;
  EXPECT_LT(falling_exponential(1e300), 1e-300);
  EXPECT_TRUE(std::isnan(falling_exponential(std::nan(""))));
}

TEST(BranchFree, LogarithmIsThatOfTheStandardLibrary)
{
  EXPECT_EQ(natural_logarithm(1), 0);
  for (double x = 1e-300; x < 1e300; x *= 1.003)
    EXPECT_NEAR(natural_logarithm(x), std::log(x), 5e-16 * std::abs(std::log(x))) << x;
  for (double change = 1e-15; change < 0.5; change *= 1.01)
    for (const double x : {1 + change, 1 - change})
      EXPECT_NEAR(natural_logarithm(x), std::log(x), 5e-16 * std::abs(std::log(x))) << x;
  EXPECT_TRUE(std::isnan(natural_logarithm(std::nan(""))));
}

TEST(BranchFree, SineAndCosineAreThoseOfTheStandardLibrary)
{
  for (double x = -std::numbers::pi / 2; x <= std::numbers::pi / 2; x += 1e-3)
  {
    EXPECT_NEAR(short_sine(x), std::sin(x), 3e-16) << x;
    EXPECT_NEAR(short_cosine(x), std::cos(x), 3e-16) << x;
  }
}
