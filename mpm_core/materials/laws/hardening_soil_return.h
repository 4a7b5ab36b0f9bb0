#pragma once
/// @file
/// The equations of the Hardening Soil law at the end of an increment, and their solution. Stresses and strains are
/// positive in compression here.

#include "materials/laws/hardening_soil.h"
#include "materials/tools/dual.h"
#include "materials/tools/lode.h"
#include "materials/tools/root.h"
#include "materials/tools/secant.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace mpm::materials::hardening_soil
{
/// Fraction by which the cosine of the threefold Lode angle is reduced, so that the edges of the hexagon are round
inline constexpr double rounding = 1e-6;
/// Least smallest principal stress above the apex, over that at the reference pressure
inline constexpr double least_stress = 1e-4;
/// Shear strain of failure by which the unknown of the mobilised strength grows by one beyond failure
inline constexpr double failure_strain = 1e-2;
/// Distance from failure, in mobilised strength, at which Newton's method goes on when it comes to the other side
inline constexpr double beside_failure = 1e-6;

/// The law with the constants of its returns worked out
struct Soil
{
  double attraction, reference;            ///< a = c cot(phi), and the reference pressure with it [Pa]
  double slope, critical_sine;             ///< N and sin(phi_cv)
  double secant, unloading;                ///< E50 and E_ur at the reference pressure [Pa]
  double exponent, failure_ratio, poisson; ///< m, R_f and Poisson's ratio
  double extension;                        ///< w in triaxial extension
  double cap_slope, cap_modulus;           ///< 1 / alpha and H [Pa]
  double least;                            ///< least s3 + a, by the tension cut-off as well [Pa]
  double shear, cap;                       ///< gamma and p_p of the law's start

  double bulk_per_young() const { return 1 / (3 * (1 - 2 * poisson)); }
  double shear_per_young() const { return 0.5 / (1 + poisson); }
};

/// The direction of a deviator, by its Lode angle
template <class T>
struct Direction
{
  T difference; ///< (s1 - s3) / q
  T smallest;   ///< (p - s3) / q
  T cap;        ///< w
};

/// @param cosine  of the threefold Lode angle, 1 in triaxial compression
template <class T>
Direction<T> direction_of(const Soil& soil, const T& cosine)
{
  const double reduced = (1 - rounding) * value_of(cosine), angle = std::acos(reduced) / 3;
  const double by_cosine = -(1 - rounding) / (3 * std::sqrt(1 - reduced * reduced));
  const double c = std::cos(angle) / 3, s = std::sin(angle) / std::numbers::sqrt3;
  // s1, s2 and s3 less p, over q: 2/3 of the cosines of the angle, less and plus 120 degrees
  const T largest = chained(cosine, 2 * c, -2 * std::numbers::inv_sqrt3 * s * by_cosine);
  const T middle = chained(cosine, s - c, (c * std::numbers::sqrt3 + s * std::numbers::inv_sqrt3) * by_cosine);
  const T smallest = -(largest + middle);
  return {largest - smallest, -smallest, largest + (soil.extension - 1) * middle - soil.extension * smallest};
}

/// exp(y) and (exp(y) - 1) / y, for a small y without a call of the library
template <class T>
struct Exponential
{
  T factor, mean;
};

template <class T>
Exponential<T> exponential_of(const T& y)
{
  const Growth<double> growth = growth_of(value_of(y));
  return {chained(y, growth.factor, growth.factor), chained(y, growth.mean, growth.slope)};
}

/// gamma of a stress on the hyperbola
/// @param stress     s3 + a
/// @param softness   t^-m of it
/// @param mobilised  (s1 - s3) / q_f
template <class T>
T shear_of(const Soil& soil, const T& stress, const T& softness, const T& mobilised)
{
  const T loading = (2 - soil.failure_ratio) / soil.secant * mobilised / (1 - soil.failure_ratio * mobilised);
  return soil.slope * stress * softness * (loading - 2 / soil.unloading * mobilised);
}

/// t^-m of s3 + a
inline double softness_of(const Soil& soil, double stress) { return std::pow(stress / soil.reference, -soil.exponent); }

/// sin(psi_m)
template <class T>
T dilatancy(const Soil& soil, const T& mobilised)
{
  const T sine = soil.slope * mobilised / (2 + soil.slope * mobilised);
  return positive_part((sine - soil.critical_sine) / (1 - soil.critical_sine * sine));
}

/// Deviatoric plastic strain of a shear strain gamma, the sum of the sizes of the principal plastic strains, whose
/// deviator has the direction of the stress's and which dilate by sin(psi_m) gamma. Two of them are compressed or two
/// extended; where the middle one is zero, as in plane strain at failure, the change is rounded.
template <class T>
T deviatoric_part(const Direction<T>& direction, const T& dilation, const T& sheared)
{
  constexpr double width = 0.01;
  const T one_compressed = 3 * (direction.difference - direction.smallest) / (1 - dilation / 3);
  const T two_compressed = 3 * direction.smallest / (1 + dilation / 3);
  const T apart = one_compressed - two_compressed;
  return 2 * sheared / (one_compressed + two_compressed + square_root(apart * apart + width * width));
}

/// p_p of the cap through a stress
template <class T>
T cap_through(const Soil& soil, const T& pressure, const T& q, const T& cap_direction)
{
  const T sheared = soil.cap_slope * cap_direction * q;
  return square_root(sheared * sheared + pressure * pressure);
}

/// Volumetric strain in which the cap hardens from a p_p on, by the logarithm of its growth
template <class T>
T cap_strain(const Soil& soil, double cap, const T& growth)
{
  const double power = 1 - soil.exponent;
  const double per_growth = soil.reference / soil.cap_modulus * std::pow(cap / soil.reference, power);
  return per_growth * growth * exponential_of<T>(power * growth).mean;
}

/// A point at the start of an increment, and the increment
struct Start
{
  double pressure;              ///< p + a
  double stress, softness;      ///< s3 + a, at least the least one, and t^-m of it
  double mobilised;             ///< (s1 - s3) / q_f, at most 1
  double shear, cap;            ///< gamma and p_p
  double volumetric;            ///< volumetric strain increment
  std::array<double, 3> square; ///< q^2 of the trial by 2 G
  std::array<double, 4> cube;   ///< q^3 cos(3 theta) of the trial by 2 G
};

/// What the end is worked out from beside the start; each is differentiated by for the tangent.
template <class T>
struct Unknowns
{
  T log_stress; ///< ln of s3 + a over that of the start
  T mobilised;  ///< (s1 - s3) / q_f up to 1; beyond it the strain of failure as well
};
template <class T>
struct Changes
{
  T volumetric{}, q{}, cosine{}; ///< of the volumetric strain, and of q and cos(3 theta) of the trial at a fixed G
};

template <class T>
struct End
{
  T shear_modulus;          ///< G, secant
  T pressure, trial_q, q;   ///< p + a, and q of the trial and of the end
  T shear, cap_growth;      ///< dgamma of hardening, and ln of the growth of p_p
  T plastic;                ///< deviatoric plastic strain increment
  T volumetric, deviatoric; ///< the two equations: what elastic and plastic strains exceed the increment by
};

template <class T>
End<T> end_of(const Soil& soil, const Start& start, const Unknowns<T>& x, const Changes<T>& changes = {})
{
  const Exponential<T> growth = exponential_of(x.log_stress);
  const Exponential<T> of_strain = exponential_of<T>((1 - soil.exponent) * x.log_stress); // the integral of 1 / E_ur
  const T stress = start.stress * growth.factor, softness = start.softness * of_strain.factor / growth.factor;
  const T young = soil.unloading / start.softness * growth.mean / of_strain.mean;
  const T shear_modulus = soil.shear_per_young() * young;

  const double double_shear = 2 * value_of(shear_modulus);
  const T square = chained(shear_modulus, polynomial<double>(start.square, double_shear),
                           2 * polynomial_slope<double>(start.square, double_shear));
  const T cube = chained(shear_modulus, polynomial<double>(start.cube, double_shear),
                         2 * polynomial_slope<double>(start.cube, double_shear));
  const T root = square_root(positive_part(square)), trial_q = root + changes.q;
  const T ratio = value_of(root) > 0 ? cube / (root * root * root) : T{1.0};
  const T cosine = (std::abs(value_of(ratio)) < 1 ? ratio : T{value_of(ratio) > 0 ? 1.0 : -1.0}) + changes.cosine;
  const Direction<T> direction = direction_of(soil, cosine);

  const T mobilised = value_of(x.mobilised) <= 1 ? x.mobilised : T{1.0};
  const T q = soil.slope * mobilised * stress / direction.difference;
  const T pressure = stress + direction.smallest * q;

  const T hardening = positive_part(shear_of(soil, stress, softness, mobilised) - start.shear);
  const T failing = failure_strain * positive_part(x.mobilised - 1);
  const T sheared = hardening + failing;
  const T dilation = dilatancy(soil, mobilised);

  const T cap = cap_through(soil, pressure, q, direction.cap) / start.cap;
  const T cap_growth = value_of(cap) > 1 ? logarithm(cap) : T{};
  const T compaction = cap_strain(soil, start.cap, cap_growth);
  const T by_cap = soil.cap_slope * direction.cap;
  const T plastic = deviatoric_part(direction, dilation, sheared) + compaction * by_cap * by_cap * q / pressure;

  const T elastic = (pressure - start.pressure) / (soil.bulk_per_young() * young);
  return {shear_modulus,
          pressure,
          trial_q,
          q,
          hardening,
          cap_growth,
          plastic,
          elastic - dilation * sheared + compaction - (start.volumetric + changes.volumetric),
          (q - trial_q) / (3 * shear_modulus) + plastic};
}

/// A solution, and whether s3 is held at its least value in place of the equation of the volumetric strain
struct Solution
{
  Unknowns<double> at;
  bool is_loose;
  End<double> end;
};

inline Solution solution_at(const Soil& soil, const Start& start, const Unknowns<double>& x, bool is_loose)
{
  return {x, is_loose, end_of<double>(soil, start, x)};
}

inline double least_log_stress(const Soil& soil, const Start& start) { return std::log(soil.least / start.stress); }

/// The end of an increment without plastic strain
struct ElasticEnd
{
  Unknowns<double> at;
  double shear_modulus, pressure, q;
  double softness; ///< t^-m of the end whose moduli it has
  double cap;      ///< p_p of the cap through it
};

/// @param log_stress  of the end whose moduli it has, an estimate of its own
inline ElasticEnd elastic_end(const Soil& soil, const Start& start, double log_stress)
{
  const Exponential<double> growth = exponential_of(log_stress);
  const Exponential<double> of_strain = exponential_of((1 - soil.exponent) * log_stress);
  const double young = soil.unloading / start.softness * growth.mean / of_strain.mean;
  const double shear = soil.shear_per_young() * young;
  const double q = std::sqrt(std::max(polynomial<double>(start.square, 2 * shear), 0.0));
  const Direction<double> direction = direction_of(soil, lode_cosine(polynomial<double>(start.cube, 2 * shear), q));
  const double pressure = start.pressure + soil.bulk_per_young() * young * start.volumetric;
  const double stress = std::max(pressure - direction.smallest * q, 0.1 * start.stress);
  return {{std::log(stress / start.stress), direction.difference * q / (soil.slope * stress)},
          shear,
          pressure,
          q,
          start.softness * of_strain.factor / growth.factor,
          cap_through(soil, pressure, q, direction.cap)};
}

/// The solution of a small elastic increment, whose moduli hardly change; nothing where it yields or is not small
inline std::optional<Solution> elastic_solution(const Soil& soil, const Start& start, ElasticEnd end)
{
  const auto yields = [&]
  {
    const double stress = start.stress * (1 + end.at.log_stress), mobilised = end.at.mobilised;
    return !(mobilised < 1 && shear_of(soil, stress, end.softness, mobilised) <= start.shear && end.cap <= start.cap);
  };
  const double lowest = least_log_stress(soil, start);
  for (int round = 0; round < 4; ++round)
  {
    if (!(std::abs(end.at.log_stress) < small_growth && end.at.log_stress > lowest) || yields())
      return {};
    const double before = end.at.log_stress;
    end = elastic_end(soil, start, before);
    if (std::abs(end.at.log_stress - before) <= 1e-6 * std::abs(before)) // the error is smaller by the growth again
      return yields() ? std::nullopt
                      : std::optional(
                            Solution{end.at, false, {end.shear_modulus, end.pressure, end.q, end.q, 0, 0, 0, 0, 0}});
  }
  return {};
}

/// Newton's method begins at the start of a small increment, else at the elastic end.
inline Unknowns<double> first_guess(const Soil& soil, const Start& start, const ElasticEnd& elastic)
{
  const Unknowns<double>& end = elastic.at;
  if (std::abs(end.log_stress) < small_growth)
    return {0, start.mobilised < 1 - beside_failure ? start.mobilised : 1 + beside_failure};
  return {std::max(end.log_stress, least_log_stress(soil, start)), std::min(end.mobilised, 0.99)};
}

/// Newton's method; nothing where it does not converge
inline std::optional<Solution> newton(const Soil& soil, const Start& start, const ElasticEnd& elastic, bool is_loose)
{
  constexpr int most = 40;
  const double lowest = least_log_stress(soil, start);
  Unknowns<double> x = first_guess(soil, start, elastic);
  if (is_loose)
    x.log_stress = lowest;
  for (int iteration = 0; iteration < most; ++iteration)
  {
    const End<Dual<2>> end = end_of<Dual<2>>(soil, start, {variable<2>(x.log_stress, 0), variable<2>(x.mobilised, 1)});
    const auto& [by_stress, by_mobilised] = end.deviatoric.slopes;
    Unknowns<double> change{0, -end.deviatoric.value / by_mobilised};
    if (!is_loose)
    {
      const auto& [volume_by_stress, volume_by_mobilised] = end.volumetric.slopes;
      const double determinant = volume_by_stress * by_mobilised - volume_by_mobilised * by_stress;
      change = {(volume_by_mobilised * end.deviatoric.value - by_mobilised * end.volumetric.value) / determinant,
                (by_stress * end.volumetric.value - volume_by_stress * end.deviatoric.value) / determinant};
    }
    if (!std::isfinite(change.log_stress + change.mobilised))
      return {};
    const double stress = std::max(x.log_stress + std::clamp(change.log_stress, -2.0, 2.0), lowest);
    double mobilised = std::max(x.mobilised + change.mobilised, 0.0);
    if ((x.mobilised > 1) != (mobilised > 1)) // on the other side of failure the slopes are others
      mobilised = mobilised > 1 ? 1 + beside_failure : 1 - beside_failure;
    const double moved = std::abs(stress - x.log_stress) + std::abs(mobilised - x.mobilised);
    x = {stress, mobilised};
    if (moved < 1e-7 * (1 + std::abs(x.log_stress) + x.mobilised)) // the error is of the order of its square
    {
      if (!is_loose && x.log_stress == lowest && change.log_stress < 0)
        return newton(soil, start, elastic, true);
      return solution_at(soil, start, x, is_loose);
    }
  }
  return {};
}

/// The mobilised strength that satisfies the equation of the deviatoric strain, which grows with it, at a fixed stress
inline double mobilised_at(const Soil& soil, const Start& start, double log_stress)
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
inline std::optional<Solution> bracketed(const Soil& soil, const Start& start)
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

inline std::optional<Solution> solution_of(const Soil& soil, const Start& start)
{
  const ElasticEnd elastic = elastic_end(soil, start, 0);
  if (const std::optional<Solution> found = elastic_solution(soil, start, elastic))
    return found;
  if (const std::optional<Solution> found = newton(soil, start, elastic, false))
    return found;
  return bracketed(soil, start);
}

Soil soil_of(const HardeningSoil& law);
} // namespace mpm::materials::hardening_soil
