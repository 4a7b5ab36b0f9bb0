#include "materials/laws/softening_mohr_coulomb.h"

#include "base/work_columns.h"
#include "materials/laws/softening_tangent.h"
#include "materials/tools/root.h"
#include "materials/tools/separation.h"

// The loops marked `ivdep` vectorise, as those of mohr_coulomb.cpp do.

namespace mpm::materials
{
using namespace mohr_coulomb;

namespace
{
/// Candidates are filled up to a multiple of this, so that none is left to the scalar remainder of a vector loop.
constexpr std::size_t lanes = 8;

/// Candidates that are returned again together until the last of them is done. Few, so that the others do not wait for
/// long.
constexpr std::size_t group_size = 64;

/// A group of candidates, from first to last
struct Group
{
  std::size_t first, last;
};

/// Accuracy of the plastic strain of a band over the softening strain, and so of the fraction of strength that is lost
constexpr double accuracy = 1e-10;

/// Steps of Newton's method after which the roots that are left are bracketed
constexpr int most_newton_steps = 6;

/// The separation among the state variables
constexpr std::size_t separation_column = 3;

/// The points of a block that may yield, side by side
template <int D>
struct Candidates
{
  std::size_t size = 0, padded = 0;
  WorkColumn<Index> point; ///< number in the batch
  WorkColumns<Spectral<D>> trial;
  WorkColumn<double> band_strain, bands_per_cell, deviation;
  WorkColumn<double> increment, excess; ///< of the plastic strain, and by how much that of its surface is larger
  WorkColumn<double> lost;              ///< fraction of the strength that is lost with it
  WorkColumn<double> next, next_excess, next_lost; ///< the same for the increment to look at next
  WorkColumns<Returned> returned;                  ///< stresses on the surface last looked at

  SofteningPoint at(const FallingStrength& strength, std::size_t i)
  {
    const Principal stress{trial.column(0).data()[i], trial.column(1).data()[i], trial.column(2).data()[i]};
    return {strength, band_strain.data()[i], bands_per_cell.data()[i], deviation.data()[i], stress};
  }
};

/// What the elastic step found in a block.
struct ElasticStep
{
  WorkColumn<std::int64_t> may_leave; ///< 1 for points that may yield
  WorkColumn<double> closed;          ///< volumetric strain by which the increment closes the separation
  std::int64_t failed = 0;            ///< number of points whose trial stress is not usable
};

/// Elastic step of the points of a block: what closes of their separation is taken from it, and stresses become trial
/// stresses where they are usable.
/// @tparam intact  whether no point has lost strength yet, nor is weaker than the law: all have the peak's surface
template <int D, Falls falls, bool intact>
void elastic_step(const FallingStrength& strength, const PointBatch<D>& points, Index first, Index last,
                  ElasticStep& step)
{
  const FallingStrength s = strength; // a copy that no store can alias
  const Surface peak = surface_after<falls>(s, 0, 0);
  const double bulk = bulk_modulus(s.moduli);
  std::int64_t failed = 0;
#pragma GCC ivdep
  for (Index i = first; i < last; ++i)
  {
    SymTensor<D> trial = elastic_trial<D>(s.moduli, points, i);
    const bool usable = is_usable<D>(trial);
    const double separation = points.state[separation_column][i];
    const double closed = close_separation<D>(trial, separation, bulk);
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] = usable ? trial[k] : points.stress[k][i];
    points.state[separation_column][i] = usable ? separation - closed : separation;
    step.closed[static_cast<std::size_t>(i - first)] = usable ? closed : 0.0;
    bool leaves;
    if constexpr (intact)
      leaves = may_yield(peak, trial);
    else
      leaves = may_yield(surface_after<falls>(s, points.state[1][i], points.state[2][i]), trial);
    step.may_leave[static_cast<std::size_t>(i - first)] = usable & leaves ? 1 : 0;
    failed += usable ? 0 : 1;
  }
  step.failed += failed;
}

/// Elastic step of the points of a block; lists those that may yield.
template <int D, Falls falls>
void elastic_step(const FallingStrength& strength, const PointBatch<D>& points, Index first, Index last,
                  ElasticStep& step, Candidates<D>& candidates)
{
  std::int64_t changed = 0;
  for (Index i = first; i < last; ++i)
    changed += (points.state[1][i] == 0) & (points.state[2][i] >= 0) ? 0 : 1;
  if (changed == 0)
    elastic_step<D, falls, true>(strength, points, first, last, step);
  else
    elastic_step<D, falls, false>(strength, points, first, last, step);
  candidates.size = 0;
  for (Index i = first; i < last; ++i) // without a branch on the single point
  {
    candidates.point[candidates.size] = i;
    candidates.size += static_cast<std::size_t>(step.may_leave[static_cast<std::size_t>(i - first)]);
  }
}

/// Copies trial stresses and states of the candidates, and fills up with copies of the first one.
template <int D>
void gather(const PointBatch<D>& points, double per_reference_length, Candidates<D>& candidates)
{
  candidates.padded = (candidates.size + lanes - 1) / lanes * lanes;
  for (std::size_t i = candidates.size; i < candidates.padded; ++i)
    candidates.point[i] = candidates.point[0];
#pragma GCC ivdep
  for (std::size_t i = 0; i < candidates.padded; ++i)
  {
    const Index p = candidates.point[i];
    SymTensor<D> trial;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      trial[k] = points.stress[k][p];
    candidates.trial.set(i, spectral(trial));
    candidates.band_strain[i] = points.state[1][p];
    candidates.deviation[i] = points.state[2][p];
  }
  for (std::size_t i = 0; i < candidates.padded; ++i)
    candidates.bands_per_cell[i] =
        points.cell_size ? points.cell_size[candidates.point[i]] * per_reference_length : 1.0;
}

/// Returns to the surfaces before the increment, their plastic strains, and the ones to expect in the end. Not inlined,
/// so that all points go through the same instructions and round alike.
template <int D, bool with_cutoff, Falls falls>
[[gnu::noinline]] void begin_returns(const FallingStrength& strength, Group group, Candidates<D>& candidates)
{
  const FallingStrength s = strength; // a copy that no store can alias
#pragma GCC ivdep
  for (std::size_t i = group.first; i < group.last; ++i)
  {
    const SofteningPoint point = candidates.at(s, i);
    const Strength left = point.strength_at<falls>(0.0);
    const Surface m = surface_of(s, left);
    const Principal stress = return_to_surface<with_cutoff>(m, point.trial).stress;
    const double first = deviatoric_plastic_strain(m, point.trial, stress);
    candidates.increment[i] = 0;
    candidates.excess[i] = first;
    candidates.lost[i] = left.lost;
    candidates.next[i] = point.template expected<falls>(m, left, stress, first);
  }
}

/// Returns to the surfaces that hold after the next plastic strains, and by how much the plastic strains of these
/// returns are larger. Not inlined, for the same reason.
template <int D, bool with_cutoff, Falls falls>
[[gnu::noinline]] void return_stresses(const FallingStrength& strength, Group group, Candidates<D>& candidates)
{
  const FallingStrength s = strength; // a copy that no store can alias
#pragma GCC ivdep
  for (std::size_t i = group.first; i < group.last; ++i)
  {
    const SofteningPoint point = candidates.at(s, i);
    const Strength left = point.strength_at<falls>(candidates.next[i]);
    const Surface m = surface_of(s, left);
    candidates.next_lost[i] = left.lost;
    const Returned returned = return_to_surface<with_cutoff>(m, point.trial);
    candidates.returned.set(i, returned);
    candidates.next_excess[i] = deviatoric_plastic_strain(m, point.trial, returned.stress) - candidates.next[i];
  }
}

/// Root of the excess of a point that Newton's method did not find. The strain stays finite while the strength falls
/// no further than to its residual, so there is a bracket.
double bracketed_increment(const SofteningPoint& point)
{
  const double first = point.excess_at(0);
  double bound = first;
  double excess = point.excess_at(bound);
  while (excess > 0)
  {
    bound *= 2;
    excess = point.excess_at(bound);
  }
  const auto excess_at = [&](double x) { return point.excess_at(x); };
  return excess == 0 ? bound : root_between(excess_at, {0, first}, {bound, excess});
}

/// One step of Newton's method for all candidates whose root is not found: their strength still changes. The plastic
/// strain of a return is all but linear in the strength that is lost, so its derivative by that is the one between the
/// last two returns, while that of the loss by the strain is known.
/// @returns number of them before the step
template <int D>
std::int64_t newton_step(const FallingStrength& strength, Group group, Candidates<D>& c)
{
  const FallingStrength s = strength; // a copy that no store can alias
  std::int64_t left = 0;
#pragma GCC ivdep
  for (std::size_t i = group.first; i < group.last; ++i)
  {
    const SofteningPoint point = c.at(s, i);
    const double x = c.next[i], excess = c.next_excess[i], lost = c.next_lost[i];
    const bool found = std::abs(excess) * c.bands_per_cell[i] * s.per_softening_strain <= accuracy;
    const double more_lost = lost - c.lost[i];
    const double per_lost =
        more_lost > 0 || more_lost < 0 ? (x + excess - c.increment[i] - c.excess[i]) / more_lost : 0.0;
    c.next[i] = found ? x : x + excess / (1 - per_lost * point.lost_per_strain(x, lost));
    c.increment[i] = found ? c.increment[i] : x;
    c.excess[i] = found ? c.excess[i] : excess;
    c.lost[i] = found ? c.lost[i] : lost;
    left += found ? 0 : 1;
  }
  return left;
}

/// Solves the fixed-point equations for the plastic strain increments of a group of candidates, side by side, by the
/// Newton's method from where they are expected. In small increments two or three returns suffice; otherwise the root
/// is bracketed.
/// @post `next` are the increments, and `returned` the stresses
template <int D, bool with_cutoff, Falls falls>
void find_increments(const FallingStrength& s, Group group, Candidates<D>& c)
{
  begin_returns<D, with_cutoff, falls>(s, group, c);
  for (int step = 0; step <= most_newton_steps; ++step)
  {
    return_stresses<D, with_cutoff, falls>(s, group, c);
    if (newton_step(s, group, c) == 0)
      return;
  }
  for (std::size_t i = group.first; i < group.last; ++i)
    if (!(std::abs(c.next_excess[i]) * c.bands_per_cell[i] * s.per_softening_strain <= accuracy))
      c.next[i] = bracketed_increment(c.at(s, i));
  return_stresses<D, with_cutoff, falls>(s, group, c);
}

template <int D, bool with_cutoff, Falls falls>
void find_increments(const FallingStrength& s, Candidates<D>& c)
{
  for (std::size_t first = 0; first < c.padded; first += group_size)
    find_increments<D, with_cutoff, falls>(s, Group{first, std::min(c.padded, first + group_size)}, c);
}

/// Final stresses and states of the candidates that yielded; the others are as they are to be.
/// @returns how many yielded
template <int D>
Index write_back(double bulk, const PointBatch<D>& points, Candidates<D>& candidates)
{
  double *const plastic_strain = points.state[0], *const band_strain = points.state[1];
  double* const separation = points.state[separation_column];
  std::int64_t plastic = 0;
#pragma GCC ivdep
  for (std::size_t i = 0; i < candidates.size; ++i)
  {
    const Index p = candidates.point[i];
    const Returned returned = candidates.returned.at(i);
    const bool yields = returned.region != Region::elastic;
    const SymTensor<D> stress = recomposed(returned.stress, candidates.trial.at(i).frame);
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][p] = yields ? stress[k] : points.stress[k][p];
    const double increment = yields ? candidates.next[i] : 0.0;
    plastic_strain[p] += increment;
    band_strain[p] += candidates.bands_per_cell[i] * increment;
    separation[p] += tension_beyond_apex(candidates.trial.at(i).stress, returned) / bulk;
    plastic += yields ? 1 : 0;
  }
  return static_cast<Index>(plastic);
}

/// Tangents of the candidates that yielded.
template <int D>
void write_tangents(const FallingStrength& strength, Candidates<D>& candidates, double* tangents)
{
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  for (std::size_t i = 0; i < candidates.size; ++i)
    if (candidates.returned.at(i).region != Region::elastic)
      write_softening_tangent<D>(candidates.at(strength, i), candidates.trial.at(i).frame, candidates.next[i],
                                 tangents + static_cast<std::size_t>(candidates.point[i]) * entries);
}
} // namespace

MohrCoulomb softened(const SofteningMohrCoulomb& law, double band_strain, double cohesion_deviation)
{
  const double lost = lost_fraction(law.shape == Softening::exponential ? 1 : 0, band_strain / law.softening_strain);
  const double factor = std::max(0.0, 1 + cohesion_deviation);
  MohrCoulomb now = law.peak;
  now.cohesion = factor * (now.cohesion + lost * (law.residual_cohesion - now.cohesion));
  now.friction_angle += lost * (law.residual_friction_angle - now.friction_angle);
  now.dilation_angle += lost * (law.residual_dilation_angle - now.dilation_angle);
  return now;
}

double p_wave_modulus(const SofteningMohrCoulomb& law) { return p_wave_modulus(law.peak); }

namespace
{
template <int D, Falls falls>
BatchReport update(const SofteningMohrCoulomb& law, const FallingStrength& strength, const PointBatch<D>& points)
{
  if (points.tangent)
    fill_elastic_tangent<D>(strength.moduli, points.size, points.tangent);
  BatchReport report;
  ElasticStep step;
  Candidates<D> candidates;
  constexpr auto block = static_cast<Index>(block_size);
  for (Index first = 0; first < points.size; first += block)
  {
    const Index last = std::min(points.size, first + block);
    elastic_step<D, falls>(strength, points, first, last, step, candidates);
    if (candidates.size > 0)
    {
      gather(points, 1 / law.reference_length, candidates);
      if (law.peak.tension_cutoff < unlimited)
        find_increments<D, true, falls>(strength, candidates);
      else
        find_increments<D, false, falls>(strength, candidates);
      report.plastic += write_back(bulk_modulus(strength.moduli), points, candidates);
    }
    if (!points.tangent)
      continue;
    if (candidates.size > 0)
      write_tangents(strength, candidates, points.tangent);
    correct_tangents<D>(step.closed, points.state[separation_column], points.tangent, first, last);
  }
  if (step.failed > 0)
    report.failed = unusable_points<D>(strength.moduli, points);
  return report;
}
} // namespace

template <int D>
BatchReport update(const SofteningMohrCoulomb& law, const PointBatch<D>& points)
{
  const FallingStrength strength = falling_strength(law);
  if (strength.psi.fall > 0)
    return update<D, Falls::dilation>(law, strength, points);
  if (strength.phi.fall > 0)
    return update<D, Falls::friction>(law, strength, points);
  return update<D, Falls::cohesion>(law, strength, points);
}

template BatchReport update<2>(const SofteningMohrCoulomb&, const PointBatch<2>&);
template BatchReport update<3>(const SofteningMohrCoulomb&, const PointBatch<3>&);
} // namespace mpm::materials
