#include "materials/laws/mohr_coulomb.h"

#include "base/work_columns.h"
#include "materials/laws/mohr_coulomb_tangent.h"
#include "materials/tools/separation.h"
#include "materials/tools/spectral.h"

#include <optional>

// The loops marked `ivdep` vectorise: no branch, and every local a scalar in the end. (`omp simd` would not do: it
// turns a local struct into an array over the lanes, which g++ 12 then cannot vectorise.)

namespace mpm::materials
{
using namespace mohr_coulomb;

namespace
{
/// Candidates are filled up to a multiple of this, so that no point is left to the scalar remainder of a vector loop:
/// it would be slow, and might round differently, so that a point's result would depend on its neighbours.
constexpr std::size_t lanes = 8;

/// Fraction of candidates in a block from which on all of its points are treated as such, where they are: setting them
/// side by side would cost more than the points that do not yield after all.
constexpr double dense_fraction = 0.45;

/// Points by whose fraction of candidates the rest of a block is judged: where it is over `dense_fraction`, the others
/// are taken for candidates unseen, a seventh of the law's time where all yield.
constexpr Index sample_size = 32;

/// The points of a block that may yield, side by side
template <int D>
struct Candidates
{
  std::size_t size = 0;
  WorkColumn<Index> point;           ///< number in the batch
  WorkColumns<SymTensor<D>> stress;  ///< trial stress, then the final one
  WorkColumn<double> plastic_strain; ///< accumulated plastic deviatoric strain
  WorkColumn<double> separation;     ///< volumetric strain by which the soil has been pulled apart
  WorkColumns<Spectral<D>> trial;    ///< principal stresses and directions before the return; for tangents only
  WorkColumns<Returned> returned;    ///< principal stresses after the return, and the region; for tangents only
};

Surface surface_of(const MohrCoulomb& law)
{
  constexpr double degree = std::numbers::pi / 180;
  return surface(elastic_moduli(law.young, law.poisson), law.poisson, law.cohesion, law.friction_angle * degree,
                 law.dilation_angle * degree, law.tension_cutoff);
}

/// What the elastic step found in a block.
struct ElasticStep
{
  WorkColumn<std::int64_t> may_leave; ///< 1 for points that may yield
  bool separated;                     ///< whether any point has a separation
  WorkColumn<double> closed;          ///< volumetric strain by which the increment closes it, if so
  Index leaving = 0, failed = 0;      ///< their number, and that of points whose trial stress is not usable
};

/// Elastic step of the points from to last of the block that begins with `first`: what closes of their separation is
/// taken from it, and their stress becomes the trial stress, unless that is not usable.
/// @tparam unseen     whether all are taken for points that may yield
/// @tparam separated  whether any has a separation
template <int D, bool unseen, bool separated>
void elastic_step(const Surface& m, const PointBatch<D>& points, Index first, Index from, Index last, ElasticStep& step)
{
  std::int64_t failed = 0, leaving = 0;
  const double bulk = bulk_modulus(m.moduli);
#pragma GCC ivdep
  for (Index i = from; i < last; ++i)
  {
    SymTensor<D> trial = elastic_trial<D>(m.moduli, points, i);
    const bool usable = is_usable<D>(trial);
    double separation = 0, closed = 0;
    if constexpr (separated)
    {
      separation = points.state[1][i];
      closed = close_separation<D>(trial, separation, bulk);
    }
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] = usable ? trial[k] : points.stress[k][i];
    if constexpr (separated)
    {
      points.state[1][i] = usable ? separation - closed : separation;
      step.closed[static_cast<std::size_t>(i - first)] = usable ? closed : 0.0;
    }
    const std::int64_t leaves = usable & (unseen || may_yield(m, trial)) ? 1 : 0;
    step.may_leave[static_cast<std::size_t>(i - first)] = leaves;
    leaving += leaves;
    failed += usable ? 0 : 1;
  }
  step.leaving += static_cast<Index>(leaving);
  step.failed += static_cast<Index>(failed);
}

template <int D, bool separated>
void elastic_step(const Surface& m, const PointBatch<D>& points, Index first, Index last, ElasticStep& step)
{
  const Index sampled = std::min(last, first + sample_size);
  elastic_step<D, false, separated>(m, points, first, first, sampled, step);
  if (step.leaving > dense_fraction * (sampled - first))
    elastic_step<D, true, separated>(m, points, first, sampled, last, step);
  else
    elastic_step<D, false, separated>(m, points, first, sampled, last, step);
}

/// Elastic step of the points of a block.
template <int D>
ElasticStep elastic_step(const Surface& m, const PointBatch<D>& points, Index first, Index last)
{
  ElasticStep step;
  step.separated = is_separated(points.state[1], first, last);
  if (step.separated)
    elastic_step<D, true>(m, points, first, last, step);
  else
    elastic_step<D, false>(m, points, first, last, step);
  return step;
}

/// Lists the points of a block that may yield, from the given one of its points on.
template <int D>
void list_candidates(const ElasticStep& step, Index first, Index from, Index last, Candidates<D>& candidates)
{
  candidates.size = 0;
  for (Index i = from; i < last; ++i) // without a branch on the single point
  {
    candidates.point[candidates.size] = i;
    candidates.size += static_cast<std::size_t>(step.may_leave[static_cast<std::size_t>(i - first)]);
  }
}

/// Copies the trial stresses and states of the candidates, and fills up with zeros.
template <int D>
void gather(const PointBatch<D>& points, Candidates<D>& candidates)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
#pragma GCC ivdep
    for (std::size_t i = 0; i < candidates.size; ++i)
      candidates.stress.column(k)[i] = points.stress[k][candidates.point[i]];
#pragma GCC ivdep
  for (std::size_t i = 0; i < candidates.size; ++i)
  {
    candidates.plastic_strain[i] = points.state[0][candidates.point[i]];
    candidates.separation[i] = points.state[1][candidates.point[i]];
  }
  for (std::size_t i = candidates.size; i % lanes != 0; ++i)
  {
    candidates.stress.set(i, {});
    candidates.plastic_strain[i] = 0;
    candidates.separation[i] = 0;
  }
}

/// Stresses and states of points to return, whose number fills vectors
template <int D>
struct Returning
{
  std::size_t size;
  std::array<double*, n_stress<D>> stress; ///< trial stress, then the final one
  double *plastic_strain, *separation;
};

/// Returns the trial stresses that are outside to the surface. What only tangents need is kept for them only: it would
/// not fit into the first-level cache with the rest. Not inlined, so that all points go through the same instructions
/// and round alike.
/// @returns how many yielded
template <int D, bool for_tangents, bool with_cutoff>
[[gnu::noinline]] Index return_stresses(const Surface& surface, const Returning<D>& columns, Candidates<D>& results)
{
  const Surface m = surface; // copies that no store can alias
  const auto [size, stress, plastic_strain, separation] = columns;
  const double per_bulk = 1 / bulk_modulus(m.moduli);
  std::int64_t plastic = 0;
#pragma GCC ivdep
  for (std::size_t i = 0; i < size; ++i)
  {
    SymTensor<D> trial;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      trial[k] = stress[k][i];
    const Spectral<D> spectrum = spectral(trial);
    const Returned returned = return_to_surface<with_cutoff>(m, spectrum.stress);
    const bool elastic = returned.region == Region::elastic;
    const SymTensor<D> final = recomposed(returned.stress, spectrum.frame);
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      stress[k][i] = elastic ? trial[k] : final[k]; // not one bit of an elastic stress changes
    if constexpr (for_tangents)
    {
      results.trial.set(i, spectrum);
      results.returned.set(i, returned);
    }
    plastic_strain[i] += deviatoric_plastic_strain(m, spectrum.stress, returned.stress);
    separation[i] += per_bulk * tension_beyond_apex(spectrum.stress, returned);
    plastic += elastic ? 0 : 1;
  }
  return static_cast<Index>(plastic);
}

template <int D, bool for_tangents>
Index return_stresses(const Surface& m, const Returning<D>& columns, Candidates<D>& results)
{
  if (m.tension < std::numeric_limits<double>::infinity())
    return return_stresses<D, for_tangents, true>(m, columns, results);
  return return_stresses<D, for_tangents, false>(m, columns, results);
}

/// Returns the candidates, side by side, and writes their stresses and states back.
/// @returns how many yielded
template <int D, bool for_tangents>
Index return_candidates(const Surface& m, const PointBatch<D>& points, Candidates<D>& candidates)
{
  gather(points, candidates);
  Returning<D> columns{(candidates.size + lanes - 1) / lanes * lanes,
                       {},
                       candidates.plastic_strain.data(),
                       candidates.separation.data()};
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    columns.stress[k] = candidates.stress.column(k).data();
  const Index plastic = return_stresses<D, for_tangents>(m, columns, candidates);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
#pragma GCC ivdep
    for (std::size_t i = 0; i < candidates.size; ++i)
      points.stress[k][candidates.point[i]] = candidates.stress.column(k)[i];
#pragma GCC ivdep
  for (std::size_t i = 0; i < candidates.size; ++i)
  {
    points.state[0][candidates.point[i]] = candidates.plastic_strain[i];
    points.state[1][candidates.point[i]] = candidates.separation[i];
  }
  return plastic;
}

/// Returns points from `first` on where they are; their number must fill vectors.
/// @returns how many yielded
template <int D>
Index return_in_place(const Surface& m, const PointBatch<D>& points, Index first, std::size_t size,
                      Candidates<D>& candidates)
{
  Returning<D> columns{size, {}, points.state[0] + first, points.state[1] + first};
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    columns.stress[k] = points.stress[k] + first;
  return return_stresses<D, false>(m, columns, candidates);
}

/// Writes the tangents of the candidates that yielded.
template <int D>
void write_tangents(const Surface& m, const RegionMaps& maps, const Candidates<D>& candidates, double* tangents)
{
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  for (std::size_t i = 0; i < candidates.size; ++i)
    if (candidates.returned.at(i).region != Region::elastic)
      write_tangent<D>(m, maps.of[static_cast<std::size_t>(candidates.returned.at(i).region)], candidates.trial.at(i),
                       candidates.returned.at(i), tangents + static_cast<std::size_t>(candidates.point[i]) * entries);
}

/// Returns the points of a block that yield, after its elastic step, and writes their tangents, if wanted.
/// @returns how many yielded
template <int D>
Index return_block(const Surface& m, const std::optional<RegionMaps>& maps, const PointBatch<D>& points, Index first,
                   Index last, const ElasticStep& step, Candidates<D>& candidates)
{
  Index plastic = 0, from = first; // points before `from` have been returned
  if (!points.tangent && step.failed == 0 && step.leaving > dense_fraction * (last - first))
  {
    const std::size_t size = static_cast<std::size_t>(last - first) / lanes * lanes;
    plastic += return_in_place(m, points, first, size, candidates);
    from += static_cast<Index>(size);
  }
  list_candidates(step, first, from, last, candidates);
  if (candidates.size == 0)
    return plastic;
  if (!points.tangent)
    return plastic + return_candidates<D, false>(m, points, candidates);
  plastic += return_candidates<D, true>(m, points, candidates);
  write_tangents(m, *maps, candidates, points.tangent);
  return plastic;
}
} // namespace

double p_wave_modulus(const MohrCoulomb& law) { return p_wave_modulus(elastic_moduli(law.young, law.poisson)); }

template <int D>
BatchReport update(const MohrCoulomb& law, const PointBatch<D>& points)
{
  const Surface m = surface_of(law);
  std::optional<RegionMaps> maps; // not filled with zeros where it is not needed
  if (points.tangent)
  {
    maps = region_maps(m);
    fill_elastic_tangent<D>(m.moduli, points.size, points.tangent);
  }
  BatchReport report;
  Index failed = 0;
  Candidates<D> candidates;
  constexpr auto block = static_cast<Index>(block_size);
  for (Index first = 0; first < points.size; first += block)
  {
    const Index last = std::min(points.size, first + block);
    const ElasticStep step = elastic_step(m, points, first, last);
    failed += step.failed;
    if (step.leaving > 0)
      report.plastic += return_block(m, maps, points, first, last, step, candidates);
    if (points.tangent && step.separated)
      correct_tangents<D>(step.closed, points.state[1], points.tangent, first, last);
  }
  if (failed > 0)
    report.failed = unusable_points<D>(m.moduli, points);
  return report;
}

template BatchReport update<2>(const MohrCoulomb&, const PointBatch<2>&);
template BatchReport update<3>(const MohrCoulomb&, const PointBatch<3>&);
} // namespace mpm::materials
