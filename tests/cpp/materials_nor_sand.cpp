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

/// A random stress with pressures around the image pressure, and a random strain increment of some size
Start<3> random_start(std::mt19937& random, double size)
{
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  SymTensor<3> stress, strain;
  for (std::size_t k = 0; k < 6; ++k)
  {
    stress[k] = 15e3 * normal(random);
    strain[k] = size * normal(random);
  }
  Start<3> a{.law = law, .bulk = bulk_per_pressure(law), .extension = extension_of(law), .least = 1e-3};
  a.deviator = deviator<3>(stress);
  a.strain = deviator<3>(strain);
  a.pressure = 50e3 + 100e3 * uniform(random);
  a.image = 100e3 * (0.5 + uniform(random));
  a.log = std::log(a.pressure / a.image);
  a.volumetric = size * normal(random);
  a.volume = 1.8;
  a.psi = -0.2 + 0.4 * uniform(random);
  return a;
}
} // namespace

TEST(NorSand, NewtonFindsWhatBracketsFind)
{
  std::mt19937 random(1);
  int compared = 0;
  for (const double size : {1e-5, 1e-4, 1e-3, 1e-2})
    for (int point = 0; point < 1000; ++point)
    {
      const Start<3> a = random_start(random, size);
      const Result<3> trial = result_of(a, a.bulk * a.volumetric, 0, 0);
      if (excess(trial) <= 1e-9)
        continue;
      const Result<3> found = bracketed(a);
      EXPECT_LT(residual(a, found).cwiseAbs().maxCoeff(), 1e-9);
      EXPECT_LE(found.log, 1 + 1e-12);
      const std::optional<Result<3>> fast = newton(a, trial);
      if (!fast || found.vertex)
        continue;
      ++compared;
      EXPECT_NEAR(fast->growth, found.growth, 1e-9);
      EXPECT_NEAR(fast->image_growth, found.image_growth, 1e-9);
      EXPECT_NEAR(fast->multiplier, found.multiplier, 1e-9 * (1 + found.multiplier));
    }
  EXPECT_GT(compared, 500);
}

TEST(NorSand, JacobianIsTheDerivativeOfTheResidual)
{
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform;
  for (int point = 0; point < 200; ++point)
  {
    const Start<3> a = random_start(random, 1e-3);
    const std::array<double, 3> at{0.4 * uniform(random) - 0.2, 0.4 * uniform(random) - 0.2, 1e-3 * uniform(random)};
    const bool vertex = point % 2 == 0;
    const Eigen::Matrix3d exact = jacobian(a, result_of(a, at[0], at[1], at[2], vertex));
    for (std::size_t k = 0; k < 3; ++k)
    {
      const double step = k < 2 ? 1e-6 : 1e-8;
      std::array<double, 3> more = at, less = at;
      more[k] += step;
      less[k] -= step;
      const Eigen::Vector3d change = residual(a, result_of(a, more[0], more[1], more[2], vertex)) -
                                     residual(a, result_of(a, less[0], less[1], less[2], vertex));
      const Eigen::Vector3d error = change / (2 * step) - exact.col(static_cast<int>(k));
      EXPECT_LT(error.cwiseAbs().maxCoeff(), 1e-6 * (1 + exact.cwiseAbs().maxCoeff()));
    }
  }
}
