/// The return to the Mohr-Coulomb surface against Koiter's rule, solved by exhaustion.

#include "materials_points.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>

using namespace mpm::materials;
using namespace mpm::test;
using namespace mpm::materials::mohr_coulomb;

namespace
{
using Vec3 = std::array<double, 3>;

double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// A plane gradient . s <= limit in the space of (unsorted) principal stresses, with its flow direction
struct Plane
{
  Vec3 gradient, flow;
  double limit;
};

/// The six Mohr-Coulomb and three tension planes
std::vector<Plane> planes(const MohrCoulomb& law)
{
  const double sin_phi = std::sin(law.friction_angle * degree), sin_psi = std::sin(law.dilation_angle * degree);
  std::vector<Plane> result;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
    {
      Plane plane{{}, {}, law.cohesion * std::cos(law.friction_angle * degree)};
      plane.gradient[i] = (1 + sin_phi) / 2;
      plane.gradient[j] = -(1 - sin_phi) / 2;
      plane.flow[i] = (1 + sin_psi) / 2;
      plane.flow[j] = -(1 - sin_psi) / 2;
      if (i == j)
        plane = {{}, {}, law.tension_cutoff}, plane.gradient[i] = plane.flow[i] = 1;
      if (std::isfinite(plane.limit))
        result.push_back(plane);
    }
  return result;
}

/// Solves a small dense system by elimination with pivoting; false if it is (nearly) singular.
bool solve(std::vector<std::vector<double>> a, std::vector<double>& b)
{
  const std::size_t n = b.size();
  for (std::size_t k = 0; k < n; ++k)
  {
    std::size_t pivot = k;
    for (std::size_t i = k; i < n; ++i)
      pivot = std::abs(a[i][k]) > std::abs(a[pivot][k]) ? i : pivot;
    if (std::abs(a[pivot][k]) < 1e-9)
      return false;
    std::swap(a[k], a[pivot]);
    std::swap(b[k], b[pivot]);
    for (std::size_t i = 0; i < n; ++i)
    {
      const double factor = i == k ? 0.0 : a[i][k] / a[k][k];
      for (std::size_t j = k; j < n; ++j)
        a[i][j] -= factor * a[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (std::size_t k = 0; k < n; ++k)
    b[k] /= a[k][k];
  return true;
}

/// Koiter's rule by exhaustion, without knowledge of regions: of all sets of up to three planes, the one whose
/// multipliers are positive and whose result satisfies all planes. Nothing where there is none (apex with psi = 0).
std::optional<Vec3> koiter_return(const MohrCoulomb& law, const std::vector<Plane>& all, const Vec3& trial,
                                  double scale)
{
  const ElasticModuli moduli = elastic_moduli(law.young, law.poisson);
  const double unit = 1 / moduli.shear;
  const auto stiff = [&](const Vec3& strain)
  {
    const double volumetric = moduli.lambda * unit * (strain[0] + strain[1] + strain[2]);
    return Vec3{volumetric + 2 * strain[0], volumetric + 2 * strain[1], volumetric + 2 * strain[2]};
  };
  const auto inside = [&](const Vec3& s)
  { return std::ranges::all_of(all, [&](const Plane& p) { return dot(p.gradient, s) - p.limit <= 1e-10 * scale; }); };
  if (inside(trial))
    return trial;
  const auto size = static_cast<unsigned>(all.size());
  for (unsigned set = 1; set < 1u << size; ++set)
  {
    std::vector<const Plane*> active;
    for (unsigned p = 0; p < size; ++p)
      if (set >> p & 1u)
        active.push_back(&all[p]);
    if (active.size() > 3)
      continue;
    std::vector<std::vector<double>> matrix;
    std::vector<double> multipliers;
    for (const Plane* row : active)
    {
      matrix.emplace_back();
      for (const Plane* column : active)
        matrix.back().push_back(dot(row->gradient, stiff(column->flow)));
      multipliers.push_back(dot(row->gradient, trial) - row->limit);
    }
    if (!solve(matrix, multipliers))
      continue;
    Vec3 s = trial;
    for (std::size_t p = 0; p < active.size(); ++p)
      for (std::size_t k = 0; k < 3; ++k)
        s[k] -= multipliers[p] * stiff(active[p]->flow)[k];
    if (std::ranges::all_of(multipliers, [&](double x) { return x >= -1e-10 * scale; }) && inside(s))
      return s;
  }
  return {};
}

} // namespace

// The solution is that of Koiter's rule: positive multipliers and all planes satisfied. Where psi = 0 and no flow leads
// to the surface it is the apex, by convention.
TEST(MohrCoulombReturn, FollowsKoitersRule)
{
  std::mt19937_64 random(3);
  std::array<int, n_regions> visits{};
  for (const MohrCoulomb& law : materials())
  {
    const mohr_coulomb::Surface surface = surface_of(law);
    const std::vector<Plane> all = planes(law);
    for (int i = 0; i < 5000; ++i)
    {
      const SymTensor<3> stress = random_stress<3>(random, law.cohesion > 0 ? law.cohesion : 1e3);
      const Principal trial = spectral(stress).stress;
      const double scale = std::abs(trial.s1) + std::abs(trial.s3) + law.cohesion;
      const auto expected = koiter_return(law, all, {trial.s1, trial.s2, trial.s3}, scale);
      const auto [s, region] = return_to_surface(surface, trial);
      ++visits[static_cast<std::size_t>(region)];
      if (!expected)
      {
        EXPECT_TRUE(law.dilation_angle == 0 && region == Region::apex) << static_cast<int>(region);
        continue;
      }
      const double error =
          std::max({std::abs(s.s1 - (*expected)[0]), std::abs(s.s2 - (*expected)[1]), std::abs(s.s3 - (*expected)[2])});
      ASSERT_LT(error, 1e-8 * scale) << "phi " << law.friction_angle << " psi " << law.dilation_angle << " region "
                                     << static_cast<int>(region) << " trial " << trial.s1 << " " << trial.s2 << " "
                                     << trial.s3;
    }
  }
  for (const int count : visits)
    EXPECT_GT(count, 10);
}
