/// Linear elasticity, parameters out of range, and points that cannot be updated.

#include "materials_points.h"

#include <gtest/gtest.h>

using namespace mpm::materials;
using namespace mpm::test;

namespace
{
constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// The message with which a law is refused, or nothing
std::string refusal(const Law& law)
{
  try
  {
    check(law);
  }
  catch (const InputError& error)
  {
    return error.what();
  }
  return "";
}

template <class Dimension>
class Laws : public testing::Test
{
};
using Dimensions = testing::Types<std::integral_constant<int, 2>, std::integral_constant<int, 3>>;
TYPED_TEST_SUITE(Laws, Dimensions);
} // namespace

TEST(LawParameters, AcceptsTheirRange)
{
  EXPECT_EQ(refusal(LinearElastic{1, 0}), "");
  EXPECT_EQ(refusal(LinearElastic{200e3, -0.99}), "");
  for (const MohrCoulomb& law : materials())
    EXPECT_EQ(refusal(law), "");
}

TEST(LawParameters, RefusesByNameValueAndRange)
{
  const auto starts = [](const Law& law, const std::string& text)
  { EXPECT_EQ(refusal(law).substr(0, text.size()), text) << refusal(law); };
  for (const double young : {0.0, -1.0, infinity, not_a_number})
    EXPECT_NE(refusal(LinearElastic{young, 0.3}).find("young"), std::string::npos) << young;
  starts(LinearElastic{1, 0.5}, "poisson = 0.5, but it must be in (-1, 0.5)");
  starts(LinearElastic{1, -1}, "poisson = -1, ");
  starts(LinearElastic{1, 0.7}, "poisson = 0.7, "); // 17 digits of this number are 0.69999999999999996
  starts(LinearElastic{1, not_a_number}, "poisson = ");
  starts(MohrCoulomb{-5, 0.3, 1e3, 25}, "young = -5, ");
  starts(MohrCoulomb{1e6, 0.5, 1e3, 25}, "poisson = 0.5, ");
  for (const double cohesion : {-1.0, infinity, not_a_number})
    starts(MohrCoulomb{1e6, 0.3, cohesion, 25}, "cohesion = ");
  for (const double friction_angle : {-1.0, 90.0, 95.0, infinity, not_a_number})
    starts(MohrCoulomb{1e6, 0.3, 1e3, friction_angle}, "friction_angle = ");
  for (const double dilation_angle : {-1.0, 26.0, infinity, not_a_number})
    starts(MohrCoulomb{1e6, 0.3, 1e3, 25, dilation_angle}, "dilation_angle = ");
  for (const double tension_cutoff : {-1.0, -infinity, not_a_number})
    starts(MohrCoulomb{1e6, 0.3, 1e3, 25, 0, tension_cutoff}, "tension_cutoff = ");
}

// Hooke's law by hand: E = 1000, nu = 0.25 gives lambda = G = 400.
TYPED_TEST(Laws, LinearElasticIsHookesLaw)
{
  constexpr int D = TypeParam::value, n = n_stress<D>;
  const LinearElastic law{1000, 0.25};
  EXPECT_NEAR(p_wave_modulus(law), 1200, 1e-9);
  Points<D> point(1);
  SymTensor<D> strain{}, start{};
  for (std::size_t k = 0; k < n; ++k)
  {
    strain[k] = 0.01 * static_cast<double>(k + 1);
    start[k] = static_cast<double>(k);
  }
  point.set_strain_increment(0, strain);
  point.set_stress(0, start);
  const BatchReport report = point.update(law, true);
  EXPECT_EQ(report.plastic, 0);
  EXPECT_TRUE(report.failed.empty());
  for (std::size_t k = 0; k < n; ++k)
  {
    // trace 0.06, so lambda tr = 24
    EXPECT_NEAR(point.stress[k][0], start[k] + (k < 3 ? 24 + 800 * strain[k] : 400 * strain[k]), 1e-12);
    double by_tangent = start[k];
    for (std::size_t j = 0; j < n; ++j)
      by_tangent += point.tangent[k * n + j] * strain[j];
    EXPECT_NEAR(point.stress[k][0], by_tangent, 1e-12);
  }
}

// An elastic Mohr-Coulomb point is a linear elastic one, bit for bit, tangent included.
TYPED_TEST(Laws, MohrCoulombIsElasticInside)
{
  constexpr int D = TypeParam::value;
  const LinearElastic elastic{200e3, 0.33};
  const MohrCoulomb soil{200e3, 0.33, 1e3, 25};
  EXPECT_EQ(p_wave_modulus(elastic), p_wave_modulus(soil));
  Points<D> a(1000);
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    for (std::size_t i = 0; i < 1000; ++i)
    {
      a.stress[k][i] = 50 * normal(random); // far below the cohesion
      a.strain_increment[k][i] = 1e-4 * normal(random);
    }
  Points<D> b = a;
  a.update(elastic, true);
  EXPECT_EQ(b.update(soil, true).plastic, 0);
  EXPECT_TRUE(a.stress == b.stress);
  EXPECT_TRUE(a.tangent == b.tangent);
}

// NaN, infinity and overflow are counted, wherever they come in; such a point and its state stay as they were, with the
// elastic tangent, and its neighbours are updated as without it.
TYPED_TEST(Laws, CountsPointsThatCannotBeUpdated)
{
  constexpr int D = TypeParam::value, n = n_stress<D>;
  const MohrCoulomb soil{200e3, 0.33, 1e3, 25, 5, 500};
  const LinearElastic elastic{200e3, 0.33};
  std::mt19937_64 random(10);
  Points<D> start(600);
  for (Index i = 0; i < start.size; ++i)
    start.set_stress(i, random_stress<D>(random, 1e3));
  for (std::size_t k = 0; k < n; ++k)
    for (const auto& [bad, with_tangent] : std::initializer_list<std::pair<double, bool>>{
             {not_a_number, true}, {infinity, true}, {-infinity, true}, {1e200, true}, {not_a_number, false}})
    {
      Points<D> clean = start, stress = start, strain = start;
      stress.stress[k][300] = stress.stress[k][599] = bad;
      strain.strain_increment[k][300] = strain.strain_increment[k][599] = bad;
      clean.update(soil, with_tangent);
      for (Points<D>* points : {&stress, &strain})
      {
        const Points<D> before = *points;
        Points<D> linear = *points;
        const BatchReport elastic_report = linear.update(elastic);
        const BatchReport report = points->update(soil, with_tangent);
        EXPECT_EQ(report.failed, (std::vector<Index>{300, 599}));
        EXPECT_EQ(elastic_report.failed, (std::vector<Index>{300, 599}));
        for (Index i = 0; i < start.size; ++i)
        {
          const Points<D>& expected = i == 300 || i == 599 ? before : clean;
          const auto p = static_cast<std::size_t>(i);
          for (std::size_t j = 0; j < n; ++j)
            EXPECT_EQ(std::isnan(expected.stress[j][p]) ? 0 : points->stress[j][p],
                      std::isnan(expected.stress[j][p]) ? 0 : expected.stress[j][p]);
          EXPECT_EQ(points->plastic_strain[p], expected.plastic_strain[p]);
        }
        EXPECT_TRUE(!with_tangent || points->tangent[300 * n * n] == p_wave_modulus(soil));
      }
    }
}

// Batches of any size give the same points.
TYPED_TEST(Laws, BatchSizeDoesNotMatter)
{
  constexpr int D = TypeParam::value;
  const MohrCoulomb soil{200e3, 0.33, 1e3, 25, 5, 500};
  std::mt19937_64 random(11);
  Points<D> all(600);
  for (Index i = 0; i < all.size; ++i)
    all.set_stress(i, random_stress<D>(random, 1e3));
  const Points<D> start = all;
  const Index plastic = all.update(soil).plastic;
  for (const Index size : {1, 7, 8, 255, 256, 257, 599})
  {
    Index plastic_of_parts = 0;
    for (Index first = 0; first < all.size; first += size)
    {
      Points<D> part(std::min(size, all.size - first));
      for (Index i = 0; i < part.size; ++i)
        part.set_stress(i, start.stress_of(first + i));
      plastic_of_parts += part.update(soil).plastic;
      for (Index i = 0; i < part.size; ++i)
        for (std::size_t k = 0; k < n_stress<D>; ++k)
          EXPECT_NEAR(part.stress_of(i)[k], all.stress_of(first + i)[k],
                      1e-12 * (norm(full(start.stress_of(first + i))) + soil.cohesion));
    }
    EXPECT_EQ(plastic_of_parts, plastic);
  }
  Points<D> none(0);
  EXPECT_TRUE(none.update(soil, true).failed.empty());
}
