/// The batched return to the Mohr-Coulomb surface from random trial stresses.

#include "materials_points.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace mpm::materials;
using namespace mpm::test;
using mohr_coulomb::Principal;
using mohr_coulomb::Region;

namespace
{
/// Random points of every kind; for half of them a part of the trial stress comes from the strain increment
template <int D>
Points<D> random_points(Index size, const MohrCoulomb& law, std::uint64_t seed)
{
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  const double scale = law.cohesion > 0 ? law.cohesion : 1e3;
  Points<D> points(size);
  for (Index i = 0; i < size; ++i)
  {
    points.set_stress(i, random_stress<D>(random, scale));
    SymTensor<D> strain{};
    for (double& component : strain)
      component = i % 2 == 0 ? 0.0 : scale / law.young * normal(random);
    points.set_strain_increment(i, strain);
  }
  return points;
}

template <int D>
SymTensor<D> trial_of(const MohrCoulomb& law, Points<D>& points, Index i)
{
  return elastic_trial<D>(elastic_moduli(law.young, law.poisson), points.batch(false), i);
}

std::string named(const MohrCoulomb& law)
{
  std::ostringstream name;
  name << "c " << law.cohesion << " phi " << law.friction_angle << " psi " << law.dilation_angle << " cut-off "
       << law.tension_cutoff << " poisson " << law.poisson;
  return name.str();
}

std::vector<MohrCoulomb> all_materials()
{
  std::vector<MohrCoulomb> all = materials();
  for (const MohrCoulomb& law : extreme_materials())
    all.push_back(law);
  return all;
}

template <class Dimension>
class MohrCoulombBatch : public testing::Test
{
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(MohrCoulombBatch, Dimensions);
} // namespace

// Each of 10^5 random states per material ends inside all surfaces, to 1e-9 of its own final stress (not of the trial
// stress, which may be 10^6 times larger), and every region is visited.
TYPED_TEST(MohrCoulombBatch, EndsInsideTheSurfaceFromEveryRegion)
{
  constexpr int D = TypeParam::value;
  std::array<Index, mohr_coulomb::n_regions> visits{};
  for (const MohrCoulomb& law : all_materials())
  {
    Points<D> points = random_points<D>(100000, law, 1);
    const mohr_coulomb::Surface surface = surface_of(law);
    for (Index i = 0; i < points.size; ++i)
    {
      const auto spectrum = mohr_coulomb::spectral(trial_of<D>(law, points, i));
      ++visits[static_cast<std::size_t>(mohr_coulomb::return_to_surface(surface, spectrum.stress).region)];
    }
    EXPECT_TRUE(points.update(law).failed.empty());
    const double c_cos = law.cohesion * std::cos(law.friction_angle * degree);
    const double sin_phi = std::sin(law.friction_angle * degree);
    double worst = 0;
    for (Index i = 0; i < points.size; ++i)
    {
      const Principal s = mohr_coulomb::spectral(points.stress_of(i)).stress;
      const double scale = std::max({std::abs(s.s1), std::abs(s.s3), c_cos, 1e-300});
      worst = std::max(worst, ((s.s1 - s.s3) / 2 + (s.s1 + s.s3) / 2 * sin_phi - c_cos) / scale);
      worst = std::max(worst, (s.s1 - law.tension_cutoff) / scale);
    }
    EXPECT_LT(worst, 1e-9) << named(law);
  }
  for (std::size_t region = 0; region < visits.size(); ++region)
    EXPECT_GT(visits[region], 100) << "region " << region;
}

// Zero strain on a returned state changes nothing, not one bit, in stress or state.
TYPED_TEST(MohrCoulombBatch, IsIdempotent)
{
  constexpr int D = TypeParam::value;
  for (const MohrCoulomb& law : all_materials())
  {
    Points<D> points = random_points<D>(100000, law, 2);
    points.update(law);
    points.clear_strain_increment();
    const auto stress = points.stress;
    const Column plastic_strain = points.plastic_strain;
    EXPECT_EQ(points.update(law).plastic, 0) << named(law);
    EXPECT_TRUE(points.stress == stress) << named(law);
    EXPECT_TRUE(points.plastic_strain == plastic_strain) << named(law);
  }
}

// The batch gives what the single-point functions give, in stress, state and count.
TYPED_TEST(MohrCoulombBatch, AgreesWithTheSinglePoint)
{
  constexpr int D = TypeParam::value;
  for (const MohrCoulomb& law : materials())
  {
    Points<D> points = random_points<D>(1000, law, 4);
    const mohr_coulomb::Surface surface = surface_of(law);
    std::vector<SymTensor<D>> expected, trials;
    Column plastic_strain;
    Index plastic = 0;
    for (Index i = 0; i < points.size; ++i)
    {
      trials.push_back(trial_of<D>(law, points, i));
      const auto spectrum = mohr_coulomb::spectral(trials.back());
      const auto returned = mohr_coulomb::return_to_surface(surface, spectrum.stress);
      expected.push_back(mohr_coulomb::recomposed(returned.stress, spectrum.frame));
      plastic_strain.push_back(mohr_coulomb::deviatoric_plastic_strain(surface, spectrum.stress, returned.stress));
      plastic += returned.region == Region::elastic ? 0 : 1;
    }
    EXPECT_EQ(points.update(law).plastic, plastic) << named(law);
    for (Index i = 0; i < points.size; ++i)
    {
      const auto p = static_cast<std::size_t>(i);
      const auto [low, high] = std::ranges::minmax(trials[p]);
      const double scale = std::abs(low) + std::abs(high) + law.cohesion;
      for (std::size_t k = 0; k < n_stress<D>; ++k)
        EXPECT_NEAR(points.stress_of(i)[k], expected[p][k], 1e-12 * scale) << named(law);
      EXPECT_NEAR(points.plastic_strain[p], plastic_strain[p], 1e-12 * (scale / law.young + plastic_strain[p]));
    }
  }
}

// The final stress has the principal directions of the trial stress: the two commute.
TYPED_TEST(MohrCoulombBatch, KeepsThePrincipalDirections)
{
  constexpr int D = TypeParam::value;
  for (const MohrCoulomb& law : materials())
  {
    Points<D> points = random_points<D>(2000, law, 5);
    std::vector<SymTensor<D>> trials;
    for (Index i = 0; i < points.size; ++i)
      trials.push_back(trial_of<D>(law, points, i));
    points.update(law);
    for (Index i = 0; i < points.size; ++i)
    {
      const auto a = full(trials[static_cast<std::size_t>(i)]), b = full(points.stress_of(i));
      const double scale = norm(a) * (norm(b) + 1e-300);
      for (std::size_t j = 0; j < 3; ++j)
        for (std::size_t k = 0; k < 3; ++k)
        {
          double commutator = 0;
          for (std::size_t l = 0; l < 3; ++l)
            commutator += a[j][l] * b[l][k] - b[j][l] * a[l][k];
          EXPECT_NEAR(commutator, 0, 1e-13 * scale) << named(law);
        }
    }
  }
}
