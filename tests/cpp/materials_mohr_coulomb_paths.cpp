/// Laboratory tests on one point of Mohr-Coulomb material against closed form.

#include "materials_points.h"

#include <gtest/gtest.h>

using namespace mpm::materials;
using namespace mpm::test;

namespace
{
constexpr double confinement = 5e3;

/// (1 + sin) / (1 - sin) of an angle in degrees
double flow_number(double angle) { return (1 + std::sin(angle * degree)) / (1 - std::sin(angle * degree)); }

/// One step of a test on a point: strain `axial` along yy, and along the other free directions (xx, and zz in 3D) the
/// strain that keeps their stress at minus the confinement. Newton's method with the consistent tangent of the law.
/// Returns that strain.
template <int D>
double load(const MohrCoulomb& law, Points<D>& point, double axial)
{
  const SymTensor<D> start = point.stress_of(0);
  const double start_plastic_strain = point.plastic_strain[0];
  double lateral = 0;
  for (int iteration = 0; iteration < 20; ++iteration)
  {
    point.set_stress(0, start);
    point.plastic_strain[0] = start_plastic_strain;
    SymTensor<D> strain{};
    strain[0] = lateral;
    strain[1] = axial;
    strain[2] = D == 3 ? lateral : 0.0;
    point.set_strain_increment(0, strain);
    point.update(law, true);
    const double residual = point.stress[0][0] + confinement;
    if (std::abs(residual) < 1e-10 * confinement)
      return lateral;
    lateral -= residual / (point.tangent[0] + (D == 3 ? point.tangent[2] : 0.0));
  }
  ADD_FAILURE() << "lateral strain not found";
  return lateral;
}

/// Loads a point from the confinement in 100 steps well past its strength, and then tells what one more step does.
template <int D>
struct Loaded
{
  Loaded(const MohrCoulomb& law, double direction) : point(1), axial(direction * 3e-3)
  {
    SymTensor<D> start{};
    start[0] = start[1] = start[2] = -confinement;
    point.set_stress(0, start);
    for (int step = 0; step < 100; ++step)
      load(law, point, axial);
    strength = point.stress[1][0];
    const double plastic_strain = point.plastic_strain[0];
    lateral = load(law, point, axial);
    plastic_strain_increment = point.plastic_strain[0] - plastic_strain;
    EXPECT_NEAR(point.stress[1][0], strength, 1e-8 * std::abs(strength)) << "not yet at its strength";
  }

  Points<D> point;
  double axial;                    ///< axial strain of the last step
  double lateral;                  ///< lateral strain of the last step; all of it plastic, as the stress stays
  double strength;                 ///< axial stress [Pa]
  double plastic_strain_increment; ///< of the last step
};

std::vector<MohrCoulomb> soils()
{
  return {{200e3, 0.33, 1e3, 25, 0}, {200e3, 0.33, 1e3, 25, 25}, {200e3, 0.2, 0, 35, 10}, {200e3, 0.3, 3e3, 0, 0}};
}

double compressive_strength(const MohrCoulomb& law)
{
  const double n = flow_number(law.friction_angle);
  return -(confinement * n + 2 * law.cohesion * std::sqrt(n));
}

double extensive_strength(const MohrCoulomb& law)
{
  const double n = flow_number(law.friction_angle);
  return -(confinement - 2 * law.cohesion * std::sqrt(n)) / n;
}
} // namespace

// Triaxial compression: sigma_3 = N sigma_1 - 2 c sqrt(N). Both planes that meet in the edge flow, each with lateral to
// axial strain N_psi : -1, together 2 lateral = -N_psi axial.
TEST(MohrCoulombPaths, TriaxialCompression)
{
  for (const MohrCoulomb& law : soils())
  {
    const Loaded<3> test(law, -1);
    EXPECT_NEAR(test.strength, compressive_strength(law), 1e-8 * confinement);
    EXPECT_NEAR(2 * test.lateral, -flow_number(law.dilation_angle) * test.axial, 1e-8 * std::abs(test.axial));
    // sqrt(2/3 e : e) with e = (l, a, l) - mean is 2/3 |a - l|
    EXPECT_NEAR(test.plastic_strain_increment, 2.0 / 3 * std::abs(test.axial - test.lateral), 1e-10);
  }
}

// Triaxial extension: the axial stress is the major one; axial to lateral strain is N_psi : -1/2.
TEST(MohrCoulombPaths, TriaxialExtension)
{
  for (const MohrCoulomb& law : soils())
  {
    const Loaded<3> test(law, 1);
    EXPECT_NEAR(test.strength, extensive_strength(law), 1e-8 * confinement);
    EXPECT_NEAR(test.axial, -2 * test.lateral * flow_number(law.dilation_angle), 1e-8 * test.axial);
    EXPECT_NEAR(test.plastic_strain_increment, 2.0 / 3 * std::abs(test.axial - test.lateral), 1e-10);
  }
}

// Biaxial compression in plane strain: the same strength, and volumetric strain = sin(psi) (e1 - e3).
TEST(MohrCoulombPaths, BiaxialCompression)
{
  for (const MohrCoulomb& law : soils())
  {
    const Loaded<2> test(law, -1);
    EXPECT_NEAR(test.strength, compressive_strength(law), 1e-8 * confinement);
    EXPECT_NEAR(test.lateral + test.axial, std::sin(law.dilation_angle * degree) * (test.lateral - test.axial),
                1e-8 * std::abs(test.axial));
  }
}

TEST(MohrCoulombPaths, BiaxialExtension)
{
  for (const MohrCoulomb& law : soils())
  {
    const Loaded<2> test(law, 1);
    EXPECT_NEAR(test.strength, extensive_strength(law), 1e-8 * confinement);
    EXPECT_NEAR(test.lateral + test.axial, std::sin(law.dilation_angle * degree) * (test.axial - test.lateral),
                1e-8 * test.axial);
  }
}

// A step back from the strength, with free sides, is elastic: only the axial stress changes, by E times the strain.
TEST(MohrCoulombPaths, UnloadsElastically)
{
  for (const MohrCoulomb& law : soils())
  {
    Loaded<3> test(law, -1);
    const SymTensor<3> start = test.point.stress_of(0);
    const double plastic_strain = test.point.plastic_strain[0];
    const double e = 1e-5;
    test.point.set_strain_increment(0, {-law.poisson * e, e, -law.poisson * e, 0, 0, 0});
    EXPECT_EQ(test.point.update(law).plastic, 0);
    EXPECT_NEAR(test.point.stress[0][0], start[0], 1e-10);
    EXPECT_NEAR(test.point.stress[1][0], start[1] + law.young * e, 1e-10);
    EXPECT_NEAR(test.point.stress[2][0], start[2], 1e-10);
    EXPECT_EQ(test.point.plastic_strain[0], plastic_strain);
  }
}

// A cut-off limits the tensile strength: pulled along yy with free sides, the point carries the cut-off.
TEST(MohrCoulombPaths, TensionCutoff)
{
  const MohrCoulomb law{200e3, 0.3, 1e3, 25, 0, 400};
  Points<3> point(1);
  for (int step = 0; step < 50; ++step)
  {
    const double e = 1e-4;
    point.set_strain_increment(0, {-law.poisson * e, e, -law.poisson * e, 0, 0, 0}); // uniaxial stress while elastic
    point.update(law);
    EXPECT_NEAR(point.stress[1][0], std::min(law.young * e * (step + 1), 400.0), 1e-9);
  }
}

// Tresca: the shear strength is c whatever the mean stress, and plastic flow keeps the volume, so that the mean stress
// stays that of the trial.
TEST(MohrCoulombPaths, ZeroFrictionIsTresca)
{
  const MohrCoulomb law{200e3, 0.3, 1e3, 0, 0};
  std::mt19937_64 random(8);
  int plastic = 0;
  for (int i = 0; i < 10000; ++i)
  {
    Points<3> point(1);
    const SymTensor<3> trial = random_stress<3>(random, 1e3);
    point.set_stress(0, trial);
    const bool yields = point.update(law).plastic > 0;
    const SymTensor<3> stress = point.stress_of(0);
    const auto before = mohr_coulomb::spectral(trial).stress, after = mohr_coulomb::spectral(stress).stress;
    const double scale = std::abs(before.s1) + std::abs(before.s3) + law.cohesion;
    EXPECT_EQ(yields, before.s1 - before.s3 > 2 * law.cohesion);
    EXPECT_NEAR(after.s1 - after.s3, std::min(before.s1 - before.s3, 2 * law.cohesion), 1e-14 * scale);
    EXPECT_NEAR(stress[0] + stress[1] + stress[2], trial[0] + trial[1] + trial[2], 1e-14 * scale);
    plastic += yields ? 1 : 0;
  }
  EXPECT_GT(plastic, 1000);
}
