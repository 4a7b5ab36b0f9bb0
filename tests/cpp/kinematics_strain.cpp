#include "transfer/kinematics.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

using namespace mpm::transfer;

namespace
{
template <int D>
Matrix<D> random_matrix(std::mt19937& random)
{
  std::uniform_real_distribution<double> unit(-1, 1);
  Matrix<D> matrix;
  for (auto& row : matrix)
    for (double& entry : row)
      entry = unit(random);
  return matrix;
}

template <int D>
Matrix<D> spin_of(Matrix<D> l)
{
  for (int i = 0; i < D; ++i)
    for (int j = i; j < D; ++j)
    {
      l[i][j] = 0.5 * (l[i][j] - l[j][i]);
      l[j][i] = -l[i][j];
    }
  return l;
}

template <int D>
Particles<D> one_particle(const SymTensor<D>& stress)
{
  Particles<D> particles;
  resize(particles, 1);
  particles.volume[0] = 2;
  for (int k = 0; k < n_stress<D>; ++k)
    particles.stress[k][0] = stress[k];
  return particles;
}

/// The stress of the one particle as a 3 x 3 matrix.
template <int D>
Matrix<3> full_stress(const Particles<D>& particles)
{
  Matrix<3> s{};
  for (int k = 0; k < 3; ++k)
    s[k][k] = particles.stress[k][0];
  s[0][1] = s[1][0] = particles.stress[3][0];
  if constexpr (D == 3)
  {
    s[1][2] = s[2][1] = particles.stress[4][0];
    s[0][2] = s[2][0] = particles.stress[5][0];
  }
  return s;
}

std::array<double, 3> invariants(const Matrix<3>& s)
{
  double square = 0;
  for (const auto& row : s)
    square += dot<3>(row, row);
  const double determinant = s[0][0] * (s[1][1] * s[2][2] - s[1][2] * s[2][1]) -
                             s[0][1] * (s[1][0] * s[2][2] - s[1][2] * s[2][0]) +
                             s[0][2] * (s[1][0] * s[2][1] - s[1][1] * s[2][0]);
  return {s[0][0] + s[1][1] + s[2][2], square, determinant};
}
} // namespace

template <class T>
class StrainTest : public testing::Test
{
};
template <int N>
using Dimension = std::integral_constant<int, N>;
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(StrainTest, Dimensions);

TYPED_TEST(StrainTest, IncrementIsTheSymmetricPartWithEngineeringShear)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(1);
  const Matrix<D> l = random_matrix<D>(random);
  const auto strain = strain_increment<D>(l, 0.1);
  SymTensor<D> expected{};
  double trace = 0;
  for (int i = 0; i < D; ++i)
  {
    expected[i] = 0.1 * l[i][i];
    trace += 0.1 * l[i][i];
  }
  expected[3] = 0.1 * (l[0][1] + l[1][0]);
  if constexpr (D == 3)
  {
    expected[4] = 0.1 * (l[1][2] + l[2][1]);
    expected[5] = 0.1 * (l[0][2] + l[2][0]);
  }
  double squares = 0; // de : de of the deviator, with tensor shear
  for (int k = 0; k < n_stress<D>; ++k)
  {
    EXPECT_NEAR(strain.increment[k], expected[k], 1e-16);
    squares += k < 3 ? std::pow(expected[k] - trace / 3, 2) : 0.5 * std::pow(expected[k], 2);
  }
  EXPECT_NEAR(strain.volumetric, trace, 1e-16);
  EXPECT_NEAR(strain.deviatoric, std::sqrt(2.0 / 3 * squares), 1e-15);
}

TYPED_TEST(StrainTest, RotationIsOrthogonalHoweverLargeTheStep)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(2);
  for (double dt : {1e-6, 0.1, 1.0, 100.0})
    for (int n = 0; n < 20; ++n)
    {
      const Matrix<D> r = strain_increment<D>(random_matrix<D>(random), dt).rotation;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j)
          EXPECT_NEAR(dot<D>(r[i], r[j]), i == j ? 1 : 0, 1e-14);
    }
}

TYPED_TEST(StrainTest, SpinGivesNoStrainAndTurnsByTwiceTheArcTangent)
{
  // Cayley's transform of a spin w over dt turns by 2 atan(w dt / 2).
  constexpr int D = TypeParam::value;
  std::mt19937 random(3);
  const double dt = 0.3;
  for (int n = 0; n < 20; ++n)
  {
    const Matrix<D> w = spin_of<D>(random_matrix<D>(random));
    const auto strain = strain_increment<D>(w, dt);
    for (double component : strain.increment)
      EXPECT_EQ(component, 0);
    EXPECT_EQ(strain.volumetric, 0);
    EXPECT_EQ(strain.deviatoric, 0);
    double rate_squared = 0, trace = D == 2 ? 1 : 0;
    for (int i = 0; i < D; ++i)
    {
      trace += strain.rotation[i][i];
      for (int j = 0; j < i; ++j)
        rate_squared += w[i][j] * w[i][j];
    }
    EXPECT_NEAR(std::acos(0.5 * (trace - 1)), 2 * std::atan(0.5 * dt * std::sqrt(rate_squared)), 1e-12);
  }
  Matrix<D> turn{}; // x towards y: a positive rotation about z
  turn[1][0] = 1;
  turn[0][1] = -1;
  EXPECT_GT(strain_increment<D>(turn, dt).rotation[1][0], 0);
}

TYPED_TEST(StrainTest, TurningKeepsTheInvariantsOfTheStress)
{
  constexpr int D = TypeParam::value;
  std::mt19937 random(4);
  SymTensor<D> stress;
  for (double& component : stress)
    component = std::uniform_real_distribution<double>(-1e5, 1e5)(random);
  auto particles = one_particle<D>(stress);
  const auto before = invariants(full_stress(particles));
  for (int n = 0; n < 1000; ++n)
    strain_particles<D>(particles, 0, 1, strain_increment<D>(spin_of<D>(random_matrix<D>(random)), 0.5));
  const auto after = invariants(full_stress(particles));
  EXPECT_NEAR(after[0], before[0], 1e-11 * 1e5);
  EXPECT_NEAR(after[1], before[1], 1e-11 * 1e10);
  EXPECT_NEAR(after[2], before[2], 1e-11 * 1e15);
  EXPECT_EQ(particles.volume[0], 2);
  EXPECT_EQ(particles.deviatoric_strain[0], 0);
}

TYPED_TEST(StrainTest, StressTurnsWithTheBody)
{
  // A quarter turn about z in n equal steps of angle 2 atan(w dt / 2) takes xx to yy.
  constexpr int D = TypeParam::value;
  const int n = 50;
  Matrix<D> spin{};
  spin[1][0] = 2 * std::tan(std::numbers::pi / (4 * n));
  spin[0][1] = -spin[1][0];
  SymTensor<D> stress{};
  stress[0] = 5;
  stress[2] = 3;
  auto particles = one_particle<D>(stress);
  for (int k = 0; k < n; ++k)
    strain_particles<D>(particles, 0, 1, strain_increment<D>(spin, 1.0));
  SymTensor<D> expected{};
  expected[1] = 5;
  expected[2] = 3; // that at right angles to the plane stays
  for (int k = 0; k < n_stress<D>; ++k)
    EXPECT_NEAR(particles.stress[k][0], expected[k], 1e-13);
}

TYPED_TEST(StrainTest, VolumeGrowsAndDeviatoricStrainAccumulates)
{
  constexpr int D = TypeParam::value;
  Matrix<D> l{};
  l[0][0] = 0.02;
  auto particles = one_particle<D>({});
  const auto strain = strain_increment<D>(l, 1.0);
  for (int k = 0; k < 3; ++k)
    strain_particles<D>(particles, 0, 1, strain);
  EXPECT_NEAR(particles.volume[0], 2 * std::pow(1.02, 3), 1e-14);
  EXPECT_NEAR(particles.deviatoric_strain[0], 3 * 0.02 * 2 / 3, 1e-15); // sqrt(2/3 (4 + 1 + 1) / 9) e = 2/3 e
}

TYPED_TEST(StrainTest, SettingTheVolumetricPartKeepsTheDeviator)
{
  // In plane strain the out-of-plane strain stays zero, so the in-plane difference and the shear are what is kept.
  constexpr int D = TypeParam::value;
  std::mt19937 random(5);
  const auto before = strain_increment<D>(random_matrix<D>(random), 0.1);
  auto after = before;
  set_volumetric<Cartesian<D>>(after, 0.07);
  double trace = 0;
  for (int k = 0; k < 3; ++k)
    trace += after.increment[k];
  EXPECT_NEAR(trace, 0.07, 1e-16);
  EXPECT_NEAR(after.volumetric, 0.07, 1e-16);
  for (int k = 1; k < D; ++k)
    EXPECT_NEAR(after.increment[k] - after.increment[0], before.increment[k] - before.increment[0], 1e-16);
  for (int k = 3; k < n_stress<D>; ++k)
    EXPECT_EQ(after.increment[k], before.increment[k]);
  if constexpr (D == 2)
  {
    EXPECT_EQ(after.increment[2], 0);
  }
  else
  {
    EXPECT_NEAR(after.deviatoric, before.deviatoric, 1e-16);
  }
}
