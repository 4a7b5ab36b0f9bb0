#pragma once
/// @file
/// How the equations of the Hardening Soil law are solved: by a fixed-point iteration where a small increment stays
/// elastic, else by Newton's method, else by brackets.

#include "materials/laws/hardening_soil_equations.h"
#include "materials/tools/root.h"

#include <limits>
#include <optional>

namespace mpm::materials::hardening_soil
{
/// Distance from failure, in mobilised strength, at which Newton's method goes on when it comes to the other side
inline constexpr double beside_failure = 1e-6;

/// A solution, and whether s3 is held at its least value in place of the equation of the volumetric strain
template <class N>
struct Solution
{
  Unknowns<N> at;
  bool is_loose;
  End<N> end;
};

template <class N>
N least_log_stress(const Soil& soil, const Start<N>& start)
{
  return logarithm<N>(soil.least / start.stress);
}

/// The end of an increment without plastic strain, its stress being s3 + a
template <class N>
struct ElasticEnd
{
  Unknowns<N> at;
  N shear_modulus, stress, pressure, q;
  N softness; ///< t^-m of the end whose moduli it has
  N cap;      ///< p_p of the cap through it
};

/// @param log_stress  of the end whose moduli it has, an estimate of its own
template <class N>
ElasticEnd<N> elastic_end(const Soil& soil, const Start<N>& start, const N& log_stress)
{
  const Exponential<N> growth = exponential_of(log_stress);
  const Exponential<N> of_strain = exponential_of<N>((1 - soil.exponent) * log_stress);
  const N young = soil.unloading / start.softness * growth.mean / of_strain.mean * start.small.stiffness;
  const N shear = soil.shear_per_young() * young;
  const N q = root(larger<N>(polynomial<N>(start.square, 2 * shear), N{}));
  const Direction<N> direction = direction_of(soil, lode_cosine<N>(polynomial<N>(start.cube, 2 * shear), q));
  const N pressure = start.pressure + soil.bulk_per_young() * young * start.volumetric;
  const N stress = larger<N>(pressure - direction.smallest * q, 0.1 * start.stress);
  return {{logarithm<N>(stress / start.stress), direction.difference * q / (soil.slope * stress)},
          shear,
          stress,
          pressure,
          q,
          start.softness * of_strain.factor / growth.factor,
          cap_through(soil, pressure, q, direction.cap)};
}

/// Whether an elastic end is outside of the hyperbola or of the cap, with the moduli of an estimate of its own
template <class N>
Mask<N> yields(const Soil& soil, const Start<N>& start, const ElasticEnd<N>& end)
{
  const N shear = shear_of(soil, end.stress, end.softness, end.at.mobilised);
  return !((end.at.mobilised < 1) & (shear <= start.shear) & (end.cap <= start.cap));
}

/// The solutions of small elastic increments, whose moduli hardly change.
/// @param end  at first with the moduli of the start, then with its own where there is a solution
/// @returns where there is one: where an end does not yield and is small
template <class N>
Mask<N> find_elastic(const Soil& soil, const Start<N>& start, ElasticEnd<N>& end)
{
  const auto is_elastic = [&]
  {
    return Mask<N>((absolute(end.at.log_stress) < small_growth) & (end.stress > soil.least) &
                   !yields(soil, start, end));
  };
  N estimate{};
  Mask<N> open = is_elastic(), found{};
  for (int round = 0; round < 6 && any(open); ++round)
  {
    const Mask<N> settled = open & (absolute<N>(end.at.log_stress - estimate) <= 1e-8); // moduli to half of that
    found = found | settled;
    open = open & !settled;
    if (!any(open))
      break;
    estimate = chosen<N>(open, end.at.log_stress, estimate);
    end = elastic_end(soil, start, estimate);
    open = open & is_elastic();
  }
  return found;
}

template <class N>
Solution<N> elastic_solution(const ElasticEnd<N>& end)
{
  return {end.at, false, {end.shear_modulus, end.pressure, end.q, end.q, N{}, N{}, N{}, N{}, N{}}};
}

/// Newton's method begins at the start of a small increment, else at the elastic end.
/// @param elastic  with the moduli of the start
template <class N>
Unknowns<N> first_guess(const Start<N>& start, const ElasticEnd<N>& elastic, const N& lowest)
{
  const Unknowns<N>& end = elastic.at;
  const Mask<N> is_small = absolute(end.log_stress) < small_growth;
  const N begun = chosen<N>(start.mobilised < 1 - beside_failure, start.mobilised, N{} + (1 + beside_failure));
  return {chosen<N>(is_small, N{}, larger(end.log_stress, lowest)),
          chosen<N>(is_small, begun, smaller<N>(end.mobilised, N{} + 0.99))};
}

/// What Newton's method comes to
template <class N>
struct Found
{
  Unknowns<N> at;
  Mask<N> converged;
  Mask<N> falls; ///< where s3 would fall below its least value
};

/// @param wanted  which points are solved
template <class N>
Found<N> newton(const Soil& soil, const Start<N>& start, const ElasticEnd<N>& elastic, bool is_loose,
                const Mask<N>& wanted)
{
  constexpr int most = 40;
  const N lowest = least_log_stress(soil, start);
  Found<N> found{first_guess(start, elastic, lowest), {}, {}};
  Unknowns<N>& x = found.at;
  if (is_loose)
    x.log_stress = lowest;
  Mask<N> open = wanted;
  for (int iteration = 0; iteration < most && any(open); ++iteration)
  {
    const auto end = end_of<Dual<2, N>>(soil, start, {variable<2>(x.log_stress, 0), variable<2>(x.mobilised, 1)});
    const auto& [by_stress, by_mobilised] = end.deviatoric.slopes;
    Unknowns<N> change{N{}, -end.deviatoric.value / by_mobilised};
    if (!is_loose)
    {
      const auto& [volume_by_stress, volume_by_mobilised] = end.volumetric.slopes;
      const N determinant = volume_by_stress * by_mobilised - volume_by_mobilised * by_stress;
      change = {(volume_by_mobilised * end.deviatoric.value - by_mobilised * end.volumetric.value) / determinant,
                (by_stress * end.volumetric.value - volume_by_stress * end.deviatoric.value) / determinant};
    }
    open = open & (absolute<N>(change.log_stress + change.mobilised) < std::numeric_limits<double>::infinity());
    const N bounded = larger<N>(smaller<N>(change.log_stress, N{} + 2), N{} - 2);
    const N stress = larger<N>(x.log_stress + bounded, lowest);
    N mobilised = larger<N>(x.mobilised + change.mobilised, N{});
    const Mask<N> fails = mobilised > 1, crosses = (x.mobilised > 1) != fails; // where the slopes are others
    mobilised = chosen<N>(crosses, chosen<N>(fails, N{} + (1 + beside_failure), N{} + (1 - beside_failure)), mobilised);
    const N moved = absolute<N>(stress - x.log_stress) + absolute<N>(mobilised - x.mobilised);
    x = {chosen<N>(open, stress, x.log_stress), chosen<N>(open, mobilised, x.mobilised)};
    // The error is of the order of the square of the change.
    const Mask<N> ends = open & (moved < 1e-7 * (1 + absolute(x.log_stress) + x.mobilised));
    const Mask<N> falls = ends & (x.log_stress == lowest) & (change.log_stress < 0);
    found.falls = found.falls | falls;
    found.converged = found.converged | (ends & !falls);
    open = open & !ends;
  }
  return found;
}

template <class N>
Solution<N> solution_at(const Soil& soil, const Start<N>& start, const Unknowns<N>& x, bool is_loose)
{
  return {x, is_loose, end_of<N>(soil, start, x)};
}

/// The solution by Newton's method; nothing where it does not converge
inline std::optional<Solution<double>> newton_solution(const Soil& soil, const Start<double>& start,
                                                       const ElasticEnd<double>& elastic)
{
  Found<double> found = newton(soil, start, elastic, false, true);
  const bool is_loose = found.falls;
  if (is_loose)
    found = newton(soil, start, elastic, true, true);
  return found.converged ? std::optional(solution_at(soil, start, found.at, is_loose)) : std::nullopt;
}

/// The mobilised strength that satisfies the equation of the deviatoric strain, which grows with it, at a fixed stress
inline double mobilised_at(const Soil& soil, const Start<double>& start, double log_stress)
{
  const auto excess = [&](double x) { return end_of<double>(soil, start, {log_stress, x}).deviatoric; };
  const Sample first{0, excess(0)};
  if (!(first.f < 0))
    return 0;
  double most = 1;
  while (excess(most) < 0 && most < 1e12)
    most *= 4;
  return root_between(excess, first, {most, excess(most)});
}

/// The same by brackets, which cannot fail where there is a solution
inline std::optional<Solution<double>> bracketed(const Soil& soil, const Start<double>& start)
{
  const auto at = [&](double log_stress) {
    return Unknowns<double>{log_stress, mobilised_at(soil, start, log_stress)};
  };
  const auto excess = [&](double log_stress) { return end_of<double>(soil, start, at(log_stress)).volumetric; };
  const double lowest = least_log_stress(soil, start), highest = lowest + 40;
  const Sample low{lowest, excess(lowest)}, high{highest, excess(highest)};
  if (low.f > 0)
    return solution_at(soil, start, at(lowest), true);
  if (!(high.f > 0))
    return {};
  return solution_at(soil, start, at(root_between(excess, low, high)), false);
}

inline std::optional<Solution<double>> solution_of(const Soil& soil, const Start<double>& start)
{
  const ElasticEnd<double> first = elastic_end<double>(soil, start, 0);
  ElasticEnd<double> elastic = first;
  if (find_elastic(soil, start, elastic))
    return elastic_solution(elastic);
  if (const std::optional<Solution<double>> found = newton_solution(soil, start, first))
    return found;
  return bracketed(soil, start);
}

/// The ends of a few points that are the same for each; nothing where one of them needs other methods
inline std::optional<End<Lanes>> ends_of(const Soil& soil, const Start<Lanes>& start)
{
  const ElasticEnd<Lanes> first = elastic_end<Lanes>(soil, start, Lanes{});
  ElasticEnd<Lanes> elastic = first;
  const LaneMask is_elastic = find_elastic(soil, start, elastic);
  const End<Lanes> without_plastic = elastic_solution(elastic).end;
  if (!any(!is_elastic))
    return without_plastic;
  const Found<Lanes> found = newton<Lanes>(soil, start, first, false, !is_elastic);
  if (any(!(is_elastic | found.converged)))
    return {};
  return chosen_end(is_elastic, without_plastic, end_of<Lanes>(soil, start, found.at));
}
} // namespace mpm::materials::hardening_soil
