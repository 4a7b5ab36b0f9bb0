#pragma once
/// @file
/// The equations of modified Cam-Clay at the end of an increment.

#include "materials/laws/cam_clay.h"
#include "materials/tools/lode.h"
#include "materials/tools/secant.h"

namespace mpm::materials::cam_clay
{
/// The law with the constants of its returns worked out
struct Clay
{
  double shear_ratio;          ///< G / K
  double slope_squared;        ///< M^2
  double swelling, difference; ///< kappa and lambda - kappa
  double volume;               ///< specific volume at the law's start
  double preconsolidation;     ///< p_c at the law's start, attraction included
  double attraction;
  double exponent;       ///< (lambda - kappa) / mu of creep
  double creep_per_time; ///< mu / reference time; 0 without creep
};

/// A point at the start of an increment, and the increment: pressures and volumetric strains are positive in
/// compression here. Volumetric strains are the specific volume that is lost over that of the start, so that it follows
/// lambda, kappa and mu in increments of any size. Numbers of one point or, as `Lanes`, of a few side by side.
template <class T>
struct Start
{
  const Clay& clay;
  T elastic, plastic;      ///< v / kappa and v / (lambda - kappa)
  T pressure;              ///< p
  T preconsolidation;      ///< p_c
  T volumetric;            ///< volumetric strain increment, 1 - v_end / v
  T log_volume;            ///< ln(v_end / v)
  std::array<T, 3> square; ///< q^2 of the trial deviator s + 2 G e by 2 G, with the secant modulus G
};

/// What follows from the plastic part x of the volumetric strain and the plastic multiplier m
template <class T>
struct Result
{
  T x, multiplier;
  T pressure, preconsolidation;
  T shear, shear_by_y; ///< G, and its derivative by ln of the growth of the pressure
  T square;            ///< q^2 of the trial
  T ratio;             ///< of the deviator to that of the trial
  T yield;             ///< yield function over the square of p_c at the start
};

template <class T>
Result<T> result_of(const Start<T>& a, const T& x, const T& multiplier)
{
  const Growth<T> growth = growth_of<T>(a.elastic * (a.volumetric - x)), hardening = growth_of<T>(a.plastic * x);
  const T modulus = a.clay.shear_ratio * a.elastic * a.pressure, shear = modulus * growth.mean;
  const T p = a.pressure * growth.factor, pc = a.preconsolidation * hardening.factor;
  const T square = polynomial<T>(a.square, 2 * shear), ratio = 1 / (1 + 6 * shear * multiplier / a.clay.slope_squared);
  const T yield = ratio * ratio * square / a.clay.slope_squared + p * (p - pc);
  return {x,      multiplier, p,
          pc,     shear,      modulus * growth.slope,
          square, ratio,      yield / (a.preconsolidation * a.preconsolidation)};
}
} // namespace mpm::materials::cam_clay
