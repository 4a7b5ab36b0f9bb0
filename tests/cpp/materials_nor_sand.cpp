/// The return of NorSand: Newton's method against brackets, and its Jacobian against differences.

#include "materials/laws/nor_sand_return.h"

#include <gtest/gtest.h>

#include <random>

using namespace mpm::materials;
using namespace mpm::materials::nor_sand;
using mpm::base::SymTensor;

namespace
{
const NorSand law{0.9, 0.03, 1.25, 4, 100, 200, 0.2, 100e3, 0.8, 0.2, 0};
const Sand constants = sand_of(law);

/// A random stress with pressures around the image pressure, and a random strain increment of some size
Start<double> random_start(std::mt19937& random, double size)
{
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  SymTensor<3> stress, strain;
  for (std::size_t k = 0; k < 6; ++k)
  {
    stress[k] = 15e3 * normal(random);
    strain[k] = size * normal(random);
  }
  Start<double> a{constants};
  a.square = square_along<3>(deviator<3>(stress), deviator<3>(strain));
  a.cube = cube_along<3>(deviator<3>(stress), deviator<3>(strain));
  a.pressure = 50e3 + 100e3 * uniform(random);
  a.log_image = std::log(100e3 * (0.5 + uniform(random)));
  a.log = std::log(a.pressure) - a.log_image;
  a.volumetric = size * normal(random);
  a.volume = 1.8;
  a.psi = -0.2 + 0.4 * uniform(random);
  return a;
}

Equations<double> residual_of(const Start<double>& a, const Result<double>& r)
{
  return residual(a, r, most_per_image(r));
}
} // namespace

TEST(NorSand, NewtonFindsWhatBracketsFind)
{
  std::mt19937 random(1);
  int compared = 0;
  for (const double size : {1e-5, 1e-4, 1e-3, 1e-2})
    for (int point = 0; point < 1000; ++point)
    {
      const Start<double> a = random_start(random, size);
      const Result<double> trial = result_of(a, 0.0, 0.0);
      if (excess(trial) <= 1e-9)
        continue;
      const Result<double> found = bracketed(a);
      const Equations<double> error = residual_of(a, found);
      EXPECT_LT(std::max(std::abs(error.hardening), std::abs(error.yield)), 1e-9);
      EXPECT_NEAR(found.growth, constants.bulk * (a.volumetric - found.multiplier * found.image.slope * found.log),
                  1e-14);
      EXPECT_NEAR(found.log, a.log + found.growth - found.image_growth, 1e-12);
      EXPECT_LE(found.log, 1 + 1e-12);
      Result<double> fast = trial;
      if (!newton(a, fast, true) || found.vertex)
        continue;
      ++compared;
      EXPECT_NEAR(fast.growth, found.growth, 1e-9);
      EXPECT_NEAR(fast.image_growth, found.image_growth, 1e-9);
      EXPECT_NEAR(fast.multiplier, found.multiplier, 1e-9 * (1 + found.multiplier));
    }
  EXPECT_GT(compared, 500);
}

TEST(NorSand, JacobianIsTheDerivativeOfTheResidual)
{
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform;
  for (int point = 0; point < 200; ++point)
  {
    const Start<double> a = random_start(random, 1e-3);
    const double growth = 0.4 * uniform(random) - 0.2, m = 1e-3 * uniform(random);
    const bool vertex = point % 2 == 0;
    const Result<double> r = result_of(a, growth, m, vertex);
    const Jacobian<double> exact = jacobian(a, r, most_per_image(r), growth_slopes(a, r));
    const auto expect_slopes = [&](double step_of_growth, double step_of_m, double hardening, double yield)
    {
      const Result<double> more = result_of(a, growth + step_of_growth, m + step_of_m, vertex);
      const Result<double> less = result_of(a, growth - step_of_growth, m - step_of_m, vertex);
      const Equations<double> end = residual_of(a, more), start = residual_of(a, less);
      const double length = 2 * (step_of_growth + step_of_m);
      EXPECT_NEAR((end.hardening - start.hardening) / length, hardening, 1e-6 * (1 + std::abs(hardening)));
      EXPECT_NEAR((end.yield - start.yield) / length, yield, 1e-6 * (1 + std::abs(yield)));
    };
    expect_slopes(1e-6, 0, exact.hardening.image_growth, exact.yield.image_growth);
    expect_slopes(0, 1e-8, exact.hardening.multiplier, exact.yield.multiplier);
  }
}
