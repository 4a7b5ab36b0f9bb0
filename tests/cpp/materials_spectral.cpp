/// Principal stresses and directions, and the cheap check for yielding in three dimensions.

#include "materials_points.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace mpm::materials;
using namespace mpm::test;
using namespace mpm::materials::mohr_coulomb;

namespace
{
double dot(const Direction& a, const Direction& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Random symmetric matrices of size one: dense, graded, close to a multiple of the unit matrix, of rank one, of signs
SymTensor<3> random_matrix(std::mt19937_64& random, int kind)
{
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> exponent(-12, 0);
  const double small = kind == 0 ? 1.0 : std::pow(10, exponent(random));
  SymTensor<3> matrix{};
  if (kind == 1 || kind == 2)
    matrix[0] = matrix[1] = 1;
  if (kind == 2)
    matrix[2] = 1;
  if (kind == 3)
    matrix.fill(1);
  for (double& entry : matrix)
    entry += kind == 4 ? (normal(random) > 0 ? 1 : -1) + small * normal(random) : small * normal(random);
  return matrix;
}
} // namespace

TEST(Spectral, ReproducesTheMatrixWithSortedValuesAndOrthonormalDirections)
{
  std::mt19937_64 random(12);
  for (int i = 0; i < 200000; ++i)
  {
    const SymTensor<3> matrix = random_matrix(random, i % 5);
    const auto [s, frame] = spectral(matrix);
    const SymTensor<3> again = recomposed(s, frame);
    const double size = norm(full(matrix));
    for (std::size_t k = 0; k < 6; ++k)
      ASSERT_NEAR(again[k], matrix[k], 1e-14 * size);
    ASSERT_TRUE(s.s1 >= s.s2 && s.s2 >= s.s3);
    ASSERT_NEAR(dot(frame.n1, frame.n1), 1, 1e-14);
    ASSERT_NEAR(dot(frame.n2, frame.n2), 1, 1e-14);
    ASSERT_NEAR(dot(frame.n3, frame.n3), 1, 1e-14);
    ASSERT_NEAR(dot(frame.n1, frame.n2), 0, 1e-14);
    ASSERT_NEAR(dot(frame.n2, frame.n3), 0, 1e-14);
    ASSERT_NEAR(dot(frame.n3, frame.n1), 0, 1e-14);
  }
}

// The check from invariants lets no stress pass that is outside, however little (here 1e-10 of its size), wherever it
// is on the surface, and lets pass what is inside by more than its margin of 1e-6, which it must for speed.
TEST(Spectral, TheCheckForYieldingMissesNothing)
{
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> uniform;
  for (const MohrCoulomb& law :
       {MohrCoulomb{200e3, 0.33, 0, 30}, MohrCoulomb{200e3, 0.33, 1e3, 0}, MohrCoulomb{200e3, 0.33, 1e3, 25, 0, 500}})
  {
    const mohr_coulomb::Surface m = surface_of(law);
    for (int i = 0; i < 100000; ++i)
    {
      const double s1 = m.tension < m.apex && i % 2 == 0 ? m.tension : -1e4 * uniform(random);
      const double lowest = m.slope * s1 - m.strength;
      const double s3 = s1 == m.tension ? lowest + (s1 - lowest) * uniform(random) : lowest;
      const double between[] = {0.0, 1e-9, 1.0, 1 - 1e-9, uniform(random)};
      const double s2 = s1 + (s3 - s1) * between[i % 5];
      const Frame<3> frame = spectral(random_matrix(random, 0)).frame;
      const double size = std::abs(s1) + std::abs(s3) + m.cohesion_cos;
      const double out = 1e-10 * size, in = -1e-5 * size;
      EXPECT_TRUE(may_yield(m, recomposed({s1 + out, s2 + out, s3 - out}, frame)));
      EXPECT_FALSE(may_yield(m, recomposed({s1 + in, std::min(std::max(s2, s3 - in), s1 + in), s3 - in}, frame)));
    }
  }
}
