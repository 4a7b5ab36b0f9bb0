#pragma once
/// @file
/// The equations of the Hardening Soil law at the end of an increment, for one point or for a few side by side
/// (`Lanes`), with derivatives or without. Stresses and strains are positive in compression here.

#include "materials/laws/hardening_soil.h"
#include "materials/laws/hardening_soil_small_strain.h"
#include "materials/tools/dual.h"
#include "materials/tools/lode.h"
#include "materials/tools/secant.h"

#include <array>
#include <numbers>

namespace mpm::materials::hardening_soil
{
/// Fraction by which the cosine of the threefold Lode angle is reduced, so that the edges of the hexagon are round
inline constexpr double rounding = 1e-6;
/// Least smallest principal stress above the apex, over that at the reference pressure
inline constexpr double least_stress = 1e-4;
/// Shear strain of failure by which the unknown of the mobilised strength grows by one beyond failure
inline constexpr double failure_strain = 1e-2;

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
  SmallStrain small{};                     ///< small-strain stiffness

  double bulk_per_young() const { return 1 / (3 * (1 - 2 * poisson)); }
  double shear_per_young() const { return 0.5 / (1 + poisson); }
};

Soil soil_of(const HardeningSoil& law);

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
  using N = Number<T>;
  const N reduced = (1 - rounding) * value_of(cosine), third = third_cosine(reduced);
  const N by_cosine = -(1 - rounding) / (3 * root(N(1 - reduced * reduced)));
  const N c = third / 3, s = root(N(1 - third * third)) * std::numbers::inv_sqrt3;
  // s1, s2 and s3 less p, over q: 2/3 of the cosines of the angle, less and plus 120 degrees
  const T largest = chained(cosine, N(2 * c), N(-2 * std::numbers::inv_sqrt3 * s * by_cosine));
  const T middle = chained(cosine, N(s - c), N((c * std::numbers::sqrt3 + s * std::numbers::inv_sqrt3) * by_cosine));
  const T smallest = -(largest + middle);
  return {largest - smallest, -smallest, largest + (soil.extension - 1) * middle - soil.extension * smallest};
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
template <class N>
N softness_of(const Soil& soil, const N& stress)
{
  return power(N(stress / soil.reference), -soil.exponent);
}

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

/// Volumetric strain in which the cap hardens, per ln of the growth of p_p from this on
template <class N>
N cap_compliance(const Soil& soil, const N& cap)
{
  return soil.reference / soil.cap_modulus * power(N(cap / soil.reference), 1 - soil.exponent);
}

/// A point, or a few side by side, at the start of an increment, and the increment
template <class N>
struct Start
{
  N pressure;                                     ///< p + a
  N stress, softness;                             ///< s3 + a, at least the least one, and t^-m of it
  N mobilised;                                    ///< (s1 - s3) / q_f, at most 1
  N shear, cap, growth;                           ///< gamma, p_p, and ln of it over that of the law's start
  N compliance;                                   ///< of the cap
  N volumetric;                                   ///< volumetric strain increment
  std::array<N, 3> square;                        ///< q^2 of the trial by 2 G
  std::array<N, 4> cube;                          ///< q^3 cos(3 theta) of the trial by 2 G
  Stiffening<N> small{N{} + 1, N{} + 1, N{} + 1}; ///< small-strain stiffness over the increment
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
  T stiffness{}, softening{};    ///< of the small-strain stiffness
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

/// Either of two ends, for each point by itself
inline End<Lanes> chosen_end(const LaneMask& first, End<Lanes> x, const End<Lanes>& y)
{
  for (const auto number : {&End<Lanes>::shear_modulus, &End<Lanes>::pressure, &End<Lanes>::trial_q, &End<Lanes>::q,
                            &End<Lanes>::shear, &End<Lanes>::cap_growth, &End<Lanes>::plastic})
    x.*number = chosen<Lanes>(first, x.*number, y.*number);
  return x;
}

template <class T>
End<T> end_of(const Soil& soil, const Start<Number<T>>& start, const Unknowns<T>& x, const Changes<T>& changes = {})
{
  using N = Number<T>;
  const T one = T{} + 1;
  const Exponential<T> growth = exponential_of(x.log_stress);
  const Exponential<T> of_strain = exponential_of<T>((1 - soil.exponent) * x.log_stress); // the integral of 1 / E_ur
  const T stress = start.stress * growth.factor, softness = start.softness * of_strain.factor / growth.factor;
  const T young =
      soil.unloading / start.softness * growth.mean / of_strain.mean * (start.small.stiffness + changes.stiffness);
  const T shear_modulus = soil.shear_per_young() * young;

  const N double_shear = 2 * value_of(shear_modulus);
  const T square = chained(shear_modulus, polynomial<N>(start.square, double_shear),
                           N(2 * polynomial_slope<N>(start.square, double_shear)));
  const T cube = chained(shear_modulus, polynomial<N>(start.cube, double_shear),
                         N(2 * polynomial_slope<N>(start.cube, double_shear)));
  const T size = square_root(positive_part(square)), trial_q = size + changes.q;
  const T ratio = chosen<T>(value_of(size) > 0, cube / (size * size * size), one);
  const N limit = chosen<N>(value_of(ratio) > 0, N{} + 1, N{} - 1);
  const T cosine = chosen<T>(absolute<N>(value_of(ratio)) < 1, ratio, T(limit)) + changes.cosine;
  const Direction<T> direction = direction_of(soil, cosine);

  const T mobilised = chosen<T>(value_of(x.mobilised) <= 1, x.mobilised, one);
  const T q = soil.slope * mobilised * stress / direction.difference;
  const T pressure = stress + direction.smallest * q;

  const T hardening = positive_part<T>(shear_of(soil, stress, softness, mobilised) - start.shear);
  const T failing = failure_strain * positive_part<T>(x.mobilised - 1);
  const T softening = start.small.softening + changes.softening;
  const T sheared = hardening * softening + failing;
  const T dilation = dilatancy(soil, mobilised);

  const T cap = cap_through(soil, pressure, q, direction.cap) / start.cap;
  const T cap_growth = chosen<T>(value_of(cap) > 1, logarithm(cap), T{});
  const T compaction =
      softening * start.compliance * cap_growth * exponential_of<T>((1 - soil.exponent) * cap_growth).mean;
  const T by_cap = soil.cap_slope * direction.cap;
  const T plastic = deviatoric_part<T>(direction, dilation, sheared) + compaction * by_cap * by_cap * q / pressure;

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
} // namespace mpm::materials::hardening_soil
