#include "materials/mohr_coulomb.h"

#include "materials/mohr_coulomb_tangent.h"
#include "materials/require.h"
#include "materials/spectral.h"

// The loops marked `ivdep` vectorise: no branch, every local a scalar in the end. (`omp simd` would not do: it turns a
// local aggregate into an array over the lanes, which g++ 12 then cannot vectorise.)

namespace mpm
{
using namespace mohr_coulomb;

namespace
{
/// Points handled at a time: their work arrays stay in the first-level cache
constexpr Index block_size = 256;
/// Candidates are filled up to a multiple of this, so that no point is left to a scalar remainder of a vector loop:
/// it would be slow, and might round differently, so that the result would depend on a point's neighbours
constexpr std::size_t lanes = 8;

template <class T>
using Work = std::array<T, block_size>;

/// The points of a block that may yield, side by side
template <int D>
struct Candidates
{
  Index size = 0;
  Work<Index> point;                          ///< number in the batch
  std::array<Work<double>, n_stress<D>> stress; ///< trial stress, then the final one
  Work<double> plastic_strain;                ///< increment of the accumulated plastic deviatoric strain
  Work<std::int64_t> is_plastic;
};

Surface surface_of(const MohrCoulomb& law)
{
  constexpr double degree = std::numbers::pi / 180;
  return surface(elastic_moduli(law.young, law.poisson), law.poisson, law.cohesion, law.friction_angle * degree,
                 law.dilation_angle * degree, law.tension_cutoff);
}

/// Elastic step of a range of points: their stress becomes the trial stress, unless that is not usable. Notes the points
/// that may yield and returns the number of those that failed.
template <int D>
Index elastic_step(const Surface& m, const PointBatch<D>& points, Index first, Index last, Candidates<D>& candidates)
{
  Work<std::int64_t> flag;
  std::int64_t failed = 0, flagged = 0;
#pragma GCC ivdep
  for (Index i = first; i < last; ++i)
  {
    const SymTensor<D> trial = elastic_trial<D>(m.moduli, points, i);
    const bool usable = is_usable<D>(trial);
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] = usable ? trial[k] : points.stress[k][i];
    const std::int64_t yields = usable & may_yield(m, trial) ? 1 : 0;
    flag[static_cast<std::size_t>(i - first)] = yields;
    flagged += yields;
    failed += usable ? 0 : 1;
  }
  candidates.size = 0;
  if (flagged > 0)
    for (Index i = first; i < last; ++i)
    {
      candidates.point[static_cast<std::size_t>(candidates.size)] = i;
      candidates.size += static_cast<Index>(flag[static_cast<std::size_t>(i - first)]);
    }
  return static_cast<Index>(failed);
}

/// Returns the trial stresses of the candidates to the surface, those that are outside
template <int D>
void return_stresses(const Surface& surface, Candidates<D>& candidates)
{
  const Surface m = surface; // a copy that no store can alias
  const std::size_t padded = (static_cast<std::size_t>(candidates.size) + lanes - 1) / lanes * lanes;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    for (auto i = static_cast<std::size_t>(candidates.size); i < padded; ++i)
      candidates.stress[k][i] = 0;
#pragma GCC ivdep
  for (std::size_t i = 0; i < padded; ++i)
  {
    SymTensor<D> trial;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      trial[k] = candidates.stress[k][i];
    const Spectral<D> principal = spectral(trial);
    const Returned returned = return_to_surface(m, principal.stress);
    const SymTensor<D> stress = recomposed(returned.stress, principal.frame);
    const bool elastic = returned.region == Region::elastic;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      candidates.stress[k][i] = elastic ? trial[k] : stress[k];
    candidates.plastic_strain[i] = deviatoric_plastic_strain(m, principal.stress, returned.stress);
    candidates.is_plastic[i] = elastic ? 0 : 1;
  }
}

/// Writes the tangents of the candidates, from their trial stresses.
template <int D>
void write_tangents(const Surface& m, const RegionMaps& maps, const Candidates<D>& candidates, double* tangents)
{
  for (std::size_t i = 0; i < static_cast<std::size_t>(candidates.size); ++i)
  {
    SymTensor<D> trial;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      trial[k] = candidates.stress[k][i];
    constexpr std::size_t entries = n_stress<D> * n_stress<D>;
    write_tangent<D>(m, maps, trial, tangents + static_cast<std::size_t>(candidates.point[i]) * entries);
  }
}

template <int D>
void gather(const PointBatch<D>& points, Candidates<D>& candidates)
{
  const auto size = static_cast<std::size_t>(candidates.size);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
#pragma GCC ivdep
    for (std::size_t i = 0; i < size; ++i)
      candidates.stress[k][i] = points.stress[k][candidates.point[i]];
}

/// Writes stress and state of the candidates back and returns how many yielded.
template <int D>
Index scatter(const Candidates<D>& candidates, const PointBatch<D>& points)
{
  const auto size = static_cast<std::size_t>(candidates.size);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
#pragma GCC ivdep
    for (std::size_t i = 0; i < size; ++i)
      points.stress[k][candidates.point[i]] = candidates.stress[k][i];
  double* const accumulated = points.state[0];
  std::int64_t plastic = 0;
#pragma GCC ivdep
  for (std::size_t i = 0; i < size; ++i)
  {
    accumulated[candidates.point[i]] += candidates.plastic_strain[i];
    plastic += candidates.is_plastic[i];
  }
  return static_cast<Index>(plastic);
}
} // namespace

void check(const MohrCoulomb& law)
{
  check_elastic(law.young, law.poisson);
  require(law.cohesion >= 0 && std::isfinite(law.cohesion), "cohesion", law.cohesion, "at least 0 and finite [Pa]");
  require(law.friction_angle >= 0 && law.friction_angle < 90, "friction_angle", law.friction_angle,
          "in [0, 90) [degrees]");
  require(law.dilation_angle >= 0 && law.dilation_angle <= law.friction_angle, "dilation_angle", law.dilation_angle,
          "between 0 and the friction angle [degrees]");
  require(law.tension_cutoff >= 0, "tension_cutoff", law.tension_cutoff, "at least 0 [Pa] (or infinite)");
}

double p_wave_modulus(const MohrCoulomb& law)
{
  const ElasticModuli moduli = elastic_moduli(law.young, law.poisson);
  return moduli.lambda + 2 * moduli.shear;
}

template <int D>
BatchReport update(const MohrCoulomb& law, const PointBatch<D>& points)
{
  const Surface m = surface_of(law);
  const RegionMaps maps = points.tangent ? region_maps(m) : RegionMaps{};
  if (points.tangent)
    fill_elastic_tangent<D>(m.moduli, points.size, points.tangent);
  BatchReport report;
  Candidates<D> candidates;
  for (Index first = 0; first < points.size; first += block_size)
  {
    const Index last = std::min(points.size, first + block_size);
    report.failed += elastic_step(m, points, first, last, candidates);
    if (candidates.size == 0)
      continue;
    gather(points, candidates);
    if (points.tangent)
      write_tangents(m, maps, candidates, points.tangent);
    return_stresses(m, candidates);
    report.plastic += scatter(candidates, points);
  }
  if (report.failed > 0)
    report.first_failed = first_unusable<D>(m.moduli, points);
  return report;
}

template BatchReport update<2>(const MohrCoulomb&, const PointBatch<2>&);
template BatchReport update<3>(const MohrCoulomb&, const PointBatch<3>&);
} // namespace mpm
