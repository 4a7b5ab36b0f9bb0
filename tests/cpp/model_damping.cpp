/// @file
/// Local damping over a step: the same law in the explicit and in the implicit scheme, and no sign left to round-off.

#include "implicit/damped_inertia.h"
#include "model/mapping.h"

#include <gtest/gtest.h>
#include <random>

using namespace mpm::implicit;

namespace
{
constexpr double mass = 3.0, dt = 0.1;

double next_velocity(double alpha, double residual, double velocity)
{
  return velocity + dt / mass * (residual - local_damping(alpha, residual, mass * velocity, dt));
}

TEST(LocalDamping, IsThatOfTheImplicitScheme)
{
  std::mt19937 random(1);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int k = 0; k < 1000; ++k)
  {
    const double alpha = 0.99 * std::abs(number(random)), velocity = number(random), residual = 40 * number(random);
    const double next = next_velocity(alpha, residual, velocity);
    EXPECT_NEAR(damped_inertia(mass, velocity, next, dt, alpha, 0, 1).force, residual, 1e-12 * 40);
  }
}

TEST(LocalDamping, HoldsForceTimesSignWhereTheVelocityKeepsIt)
{
  EXPECT_DOUBLE_EQ(local_damping(0.75, 8.0, 5.0, dt), 0.75 * 8);
  EXPECT_DOUBLE_EQ(local_damping(0.75, -8.0, 5.0, dt), 0.75 * 8);
  EXPECT_DOUBLE_EQ(local_damping(0.75, 8.0, -5.0, dt), -0.75 * 8);
  EXPECT_DOUBLE_EQ(local_damping(0.75, 8.0, 0.0, dt), 0.75 * 8); // from rest R moves the node, with (1 - alpha) R
  EXPECT_EQ(local_damping(0.75, 0.0, 5.0, dt), 0);
}

TEST(LocalDamping, NeverMakesADifferenceGrow)
{
  for (const double alpha : {0.1, 0.5, 0.75, 0.95})
    for (const double residual : {-30.0, -1e-3, 0.0, 20.0})
      for (double velocity = -2; velocity < 2; velocity += 0.01)
      {
        const double slope =
            (next_velocity(alpha, residual, velocity + 0.01) - next_velocity(alpha, residual, velocity)) / 0.01;
        EXPECT_GE(slope, (1 - alpha) / (1 + alpha) - 1e-9);
        EXPECT_LE(slope, 1 + 1e-9);
      }
}
} // namespace
