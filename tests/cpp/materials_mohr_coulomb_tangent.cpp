/// The consistent tangent of the Mohr-Coulomb law against differences of its stress.

#include "materials_points.h"

#include <gtest/gtest.h>

#include <algorithm>

using namespace mpm::materials;
using namespace mpm::test;
using mohr_coulomb::Principal;
using mohr_coulomb::Region;

namespace
{
template <class Dimension>
class MohrCoulombTangent : public testing::Test
{
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(MohrCoulombTangent, Dimensions);

/// Region of a trial stress
template <int D>
Region region_of(const mohr_coulomb::Surface& surface, const SymTensor<D>& trial)
{
  return mohr_coulomb::return_to_surface(surface, mohr_coulomb::spectral(trial).stress).region;
}

/// A point pushed by plus and minus a small strain in each component, side by side: point 2 k and 2 k + 1 of component
/// k. The strain changes the stress by some 1e-6 of its size.
template <int D>
struct Differences
{
  Differences(const MohrCoulomb& law, const SymTensor<D>& trial, double scale)
      : points(2 * n_stress<D>), step(1e-6 * scale / (law.young + p_wave_modulus(law)))
  {
    for (Index k = 0; k < n_stress<D>; ++k)
      for (Index side = 0; side < 2; ++side)
      {
        SymTensor<D> strain{};
        strain[static_cast<std::size_t>(k)] = side == 0 ? step : -step;
        points.set_stress(2 * k + side, trial);
        points.set_strain_increment(2 * k + side, strain);
      }
  }

  /// Whether no push, not even one ten times as far, leaves the region
  bool stay_in_region(const MohrCoulomb& law)
  {
    const mohr_coulomb::Surface surface = surface_of(law);
    const Region region = region_of<D>(surface, points.stress_of(0));
    Points<D> far = points;
    for (Index i = 0; i < points.size; ++i)
    {
      SymTensor<D> strain = points.strain_increment_of(i);
      for (double& component : strain)
        component *= 10;
      far.set_strain_increment(i, strain);
      if (region_of<D>(surface, elastic_trial<D>(surface.moduli, far.batch(false), i)) != region)
        return false;
    }
    return true;
  }

  /// The tangent by central differences, row-major
  Column tangent(const MohrCoulomb& law)
  {
    points.update(law);
    Column result;
    for (std::size_t j = 0; j < n_stress<D>; ++j)
      for (std::size_t k = 0; k < n_stress<D>; ++k)
        result.push_back((points.stress[j][2 * k] - points.stress[j][2 * k + 1]) / (2 * step));
    return result;
  }

  Points<D> points;
  double step;
};

/// Whether two principal stresses are close without being equal: there the tangent changes too fast for differences
bool nearly_repeated(const Principal& s, double scale)
{
  const auto close = [&](double difference) { return difference < 5e-2 * scale && difference > 1e-12 * scale; };
  return close(s.s1 - s.s2) || close(s.s2 - s.s3);
}
} // namespace

TYPED_TEST(MohrCoulombTangent, IsTheDerivativeOfTheStressInEveryRegion)
{
  constexpr int D = TypeParam::value;
  std::mt19937_64 random(6);
  std::array<int, mohr_coulomb::n_regions> visits{};
  int repeated = 0;
  for (const MohrCoulomb& law : materials())
    for (int i = 0; i < 4000; ++i)
    {
      const SymTensor<D> trial = random_stress<D>(random, law.cohesion > 0 ? law.cohesion : 1e3);
      const Principal s = mohr_coulomb::spectral(trial).stress;
      const double scale = std::abs(s.s1) + std::abs(s.s3);
      Differences<D> differences(law, trial, scale);
      if (nearly_repeated(s, scale) || !differences.stay_in_region(law))
        continue;
      Points<D> point(1);
      point.set_stress(0, trial);
      point.update(law, true);
      const Column expected = differences.tangent(law);
      const double size = p_wave_modulus(law);
      for (std::size_t k = 0; k < expected.size(); ++k)
        ASSERT_NEAR(point.tangent[k], expected[k], 1e-6 * size)
            << "entry " << k << " region " << static_cast<int>(region_of<D>(surface_of(law), trial)) << " phi "
            << law.friction_angle << " psi " << law.dilation_angle << " poisson " << law.poisson;
      ++visits[static_cast<std::size_t>(region_of<D>(surface_of(law), trial))];
      repeated += s.s1 == s.s2 || s.s2 == s.s3 ? 1 : 0;
    }
  for (std::size_t region = 0; region < visits.size(); ++region)
    EXPECT_GT(visits[region], 50) << "region " << region;
  EXPECT_GT(repeated, 50);
}

// With psi = phi the flow is associated and the tangent symmetric.
TYPED_TEST(MohrCoulombTangent, IsSymmetricForAssociatedFlow)
{
  constexpr int D = TypeParam::value, n = n_stress<D>;
  std::mt19937_64 random(7);
  const MohrCoulomb law{200e3, 0.3, 1e3, 30, 30, 500};
  Points<D> points(5000);
  for (Index i = 0; i < points.size; ++i)
    points.set_stress(i, random_stress<D>(random, 1e3));
  points.update(law, true);
  for (std::size_t p = 0; p < static_cast<std::size_t>(points.size); ++p)
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = 0; j < i; ++j)
        EXPECT_NEAR(points.tangent[(p * n + i) * n + j], points.tangent[(p * n + j) * n + i], 1e-9 * law.young);
}
