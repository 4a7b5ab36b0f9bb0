#pragma once
/// @file
/// The return of NorSand to its yield surface: two equations for the image pressure and the plastic multiplier at the
/// end of an increment, by Newton's method, and by brackets where that fails.

#include "base/lanes.h"
#include "materials/laws/nor_sand.h"
#include "materials/tools/lode.h"
#include "materials/tools/root.h"
#include "materials/tools/secant.h"

#include <array>
#include <limits>

namespace mpm::materials::nor_sand
{
/// The law with the constants of its returns worked out
struct Sand
{
  double bulk, rigidity;    ///< K / p and G / p
  double compression;       ///< lambda
  double slope, dilatancy;  ///< M and chi
  double fall, hardening;   ///< N chi and H
  double extension;         ///< b = g^4 of triaxial extension
  double attraction, least; ///< the latter the pressure that is kept at least [Pa]
  double log_least;         ///< its logarithm
  double log_image;         ///< ln of the law's image pressure in Pa
  double volume;            ///< specific volume at the law's start
  double psi;               ///< psi_i at that image pressure, less the specific volume
};

inline Sand sand_of(const NorSand& law)
{
  const double square = (1 + law.critical_slope / 3) * (1 + law.critical_slope / 3);
  const double least = 1e-6 * (law.reference_pressure + law.attraction), image = law.image_pressure + law.attraction;
  return {bulk_per_pressure(law),
          law.rigidity,
          law.critical_compression,
          law.critical_slope,
          law.dilatancy,
          law.coupling * law.dilatancy,
          law.hardening,
          square * square,
          law.attraction,
          least,
          std::log(least),
          std::log(image),
          1 + law.void_ratio,
          law.critical_compression * std::log(image / law.reference_pressure) - law.critical_void_ratio - 1};
}

/// A point at the start of an increment, and the increment: pressures and volumetric strains are positive in
/// compression here. The trial deviator s + 2 G e has the end's secant modulus G, so its invariants are polynomials in
/// 2 G, and a return works with numbers alone: those of one point or, as `Lanes`, of a few points side by side.
template <class T>
struct Start
{
  const Sand& sand;
  T pressure{};              ///< p
  T log_image{};             ///< ln of p_i in Pa
  T log{};                   ///< ln(p / p_i)
  T volumetric{};            ///< volumetric strain increment
  T volume{};                ///< specific volume at the end
  T psi{};                   ///< psi_i with the void ratio of the end and the image pressure of the start
  std::array<T, 3> square{}; ///< q^2 of the trial by 2 G
  std::array<T, 4> cube{};   ///< q^3 cos(3 theta) of the trial by 2 G; only points that may yield need it

  /// ln(p / p_i) after an elastic increment
  T trial_log() const { return log + sand.bulk * volumetric; }
};

/// What the image pressure at the end of an increment decides
template <class T>
struct Image
{
  T slope, slope_by_psi; ///< M_i of triaxial compression
  T limit, limit_by_psi; ///< chi psi_i / M_i, at most 1: then not even z = 1, at the vertex, softens
};

template <class T>
Image<T> image_of(const Sand& sand, const T& psi)
{
  const T least = T{} + sand.slope / 2, fallen = sand.slope - sand.fall * absolute(psi), one = T{} + 1;
  const T slope = larger(fallen, least), per_slope = 1 / slope;
  const T slope_by_psi = fallen > least ? (psi > 0 ? T{} - sand.fall : T{} + sand.fall) : T{};
  const T limit = smaller(sand.dilatancy * psi * per_slope, one);
  return {slope, slope_by_psi, limit, limit < one ? (sand.dilatancy - limit * slope_by_psi) * per_slope : T{}};
}

/// The trial deviator. The return keeps its direction.
template <class T>
struct Trial
{
  T shear;           ///< G
  T shear_by_growth; ///< its derivative by ln of the growth of the pressure
  T q;               ///< sqrt(3 J2)
  T lode;            ///< cos(3 theta)
  T factor;          ///< g = M / M(theta), by which q counts more than in triaxial compression
};

/// Derivative of g by cos(3 theta)
template <class T>
T factor_by_lode(const Sand& sand, const T& factor)
{
  return (1 - sand.extension) / (8 * factor * factor * factor);
}

/// The end of an increment by its unknowns, the growth of the image pressure and the multiplier
template <class T>
struct Result
{
  T image_growth; ///< L = ln of p_i over that of the start
  T multiplier;   ///< m = de_q^p / g
  bool vertex;    ///< whether q = 0, where the surface meets the axis
  Image<T> image;
  T scale;    ///< 1 + K/p m M_i
  T log;      ///< z = ln(p / p_i): g D = M_i z and g q / p = M_i (1 - z)
  T growth;   ///< y = ln of p over that of the start
  T pressure; ///< p
  Trial<T> trial;

  /// Of the deviator to that of the trial: by the yield surface, since the trial may be larger by many digits
  T ratio() const
  {
    if (vertex)
      return T{};
    return multiplier > 0 ? image.slope * (1 - log) * pressure / (trial.factor * trial.q) : T{} + 1;
  }
};

/// The result without the direction of its deviator. The pressure follows from the volumetric strain,
/// y = K/p (volumetric strain - m M_i z).
template <class T>
Result<T> undirected_result(const Start<T>& a, const T& image_growth, const T& multiplier, bool vertex = false)
{
  const Sand& sand = a.sand;
  const Image<T> image = image_of<T>(sand, a.psi + sand.compression * image_growth);
  const T scale = 1 + sand.bulk * multiplier * image.slope;
  const T log = (a.trial_log() - image_growth) / scale;
  const T y = sand.bulk * (a.volumetric - multiplier * image.slope * log);
  const Growth<T> growth = growth_of(y);
  const T modulus = sand.rigidity * a.pressure, shear = modulus * growth.mean;
  const T q = root(larger(polynomial<T>(a.square, 2 * shear), T{}));
  return {image_growth,
          multiplier,
          vertex,
          image,
          scale,
          log,
          y,
          a.pressure * growth.factor,
          {shear, modulus * growth.slope, q, T{} + 1, T{} + 1}};
}

template <class T>
void set_direction(const Start<T>& a, Trial<T>& trial)
{
  const double b = a.sand.extension;
  trial.lode = lode_cosine<T>(polynomial<T>(a.cube, 2 * trial.shear), trial.q);
  trial.factor = root(root(0.5 * (1 + b - (b - 1) * trial.lode)));
}

template <class T>
Result<T> result_of(const Start<T>& a, const T& image_growth, const T& multiplier, bool vertex = false)
{
  Result<T> r = undirected_result(a, image_growth, multiplier, vertex);
  set_direction(a, r.trial);
  return r;
}

/// Whether an elastic result may lie outside of the yield surface: the largest g, that of extension, decides.
template <class T>
Mask<T> may_yield(const Sand& sand, const Result<T>& r)
{
  return (1 + sand.slope / 3) * r.trial.q > r.image.slope * (1 - r.log) * r.pressure;
}

/// g q of the trial less the plastic strain's, less that of the yield surface, over p: the yield function where m is 0
template <class T>
T excess(const Result<T>& r)
{
  const T& g = r.trial.factor;
  return g * (r.trial.q - 3 * r.trial.shear * g * r.multiplier) / r.pressure - r.image.slope * (1 - r.log);
}

/// Its derivative by g
template <class T>
T excess_by_factor(const Result<T>& r)
{
  return (r.trial.q - 6 * r.trial.shear * r.trial.factor * r.multiplier) / r.pressure;
}

/// Derivatives by ln of the growth of the pressure, by which the trial has its shear modulus
template <class T>
struct GrowthSlopes
{
  T q;      ///< of q of the trial
  T factor; ///< of g
  T excess; ///< of the excess, at a fixed z
};

template <class T>
GrowthSlopes<T> growth_slopes(const Start<T>& a, const Result<T>& r)
{
  const T &q = r.trial.q, &g = r.trial.factor, &shear = r.trial.shear_by_growth, twice = 2 * r.trial.shear;
  const T per_q = q * q * q > 0 ? 1 / q : T{};
  const T q_slope = polynomial_slope<T>(a.square, twice) * per_q * shear;
  const T lode = (2 * polynomial_slope<T>(a.cube, twice) * shear * per_q * per_q - 3 * r.trial.lode * q_slope) * per_q;
  const T factor = factor_by_lode(a.sand, g) * lode;
  const T over = q_slope - q - 3 * (shear - r.trial.shear) * g * r.multiplier;
  return {q_slope, factor, g * over / r.pressure + excess_by_factor(r) * factor};
}

/// p_max / p_i = exp(z - chi psi_i / M_i)
template <class T>
T most_per_image(const Result<T>& r)
{
  return each(T(r.log - r.image.limit), [](double x) { return std::exp(x); });
}

/// The two equations of a plastic increment, both without unit, or changes of them
template <class T>
struct Equations
{
  T hardening, yield;
};

/// @param most  p_max / p_i of the result
template <class T>
Equations<T> residual(const Start<T>& a, const Result<T>& r, const T& most)
{
  return {r.image_growth - r.multiplier * a.sand.hardening * (most - 1), r.vertex ? r.log - 1 : excess(r)};
}

/// Changes of the unknowns, or derivatives by them
template <class T>
struct Unknowns
{
  T image_growth, multiplier;
};

/// Derivatives of z
template <class T>
Unknowns<T> log_slopes(const Start<T>& a, const Result<T>& r)
{
  const T slope_by_image = r.image.slope_by_psi * a.sand.compression, per_scale = 1 / r.scale;
  return {-(1 + a.sand.bulk * r.multiplier * slope_by_image * r.log) * per_scale,
          -a.sand.bulk * r.image.slope * r.log * per_scale};
}

/// Derivatives of the equations
template <class T>
struct Jacobian
{
  Unknowns<T> hardening, yield;

  /// Changes of the unknowns by which the equations change by `by`
  Unknowns<T> solve(const Equations<T>& by) const
  {
    const auto& [a, b] = hardening;
    const auto& [c, d] = yield;
    const T per_determinant = 1 / (a * d - b * c);
    return {(d * by.hardening - b * by.yield) * per_determinant, (a * by.yield - c * by.hardening) * per_determinant};
  }
};

/// @param most  p_max / p_i of the result
template <class T>
Jacobian<T> jacobian(const Start<T>& a, const Result<T>& r, const T& most, const GrowthSlopes<T>& by_growth)
{
  const double h = a.sand.hardening;
  const T hardening = r.multiplier * h * most, slope_by_image = r.image.slope_by_psi * a.sand.compression;
  const Unknowns<T> log = log_slopes(a, r);
  const Unknowns<T> by_hardening{1 - hardening * (log.image_growth - r.image.limit_by_psi * a.sand.compression),
                                 h * (1 - most) - hardening * log.multiplier};
  if (r.vertex)
    return {by_hardening, log};
  const T plastic = 3 * r.trial.shear * r.trial.factor * r.trial.factor / r.pressure;
  return {by_hardening,
          {by_growth.excess * (1 + log.image_growth) - slope_by_image * (1 - r.log) + r.image.slope * log.image_growth,
           (by_growth.excess + r.image.slope) * log.multiplier - plastic}};
}

/// Newton's method from the elastic result; false where it does not find a result that makes sense.
/// @param yields  of a few points those that yield; the others stay elastic
template <class T>
bool newton(const Start<T>& a, Result<T>& r, const Mask<T>& yields)
{
  const T tolerance = 1e-13 * (1 + absolute(r.growth) + r.trial.q / r.pressure);
  for (int iteration = 0; iteration < 15; ++iteration)
  {
    const T most = most_per_image(r);
    const Equations<T> error = residual(a, r, most);
    const Mask<T> is_open = yields & !((absolute(error.hardening) <= tolerance) & (absolute(error.yield) <= tolerance));
    if (!any(is_open))
      return !any(Mask<T>(yields & !((r.multiplier > 0) & (r.log <= 1))));
    const Unknowns<T> step = jacobian(a, r, most, growth_slopes(a, r)).solve(error);
    r = result_of<T>(a, r.image_growth - (is_open ? step.image_growth : T{}),
                     r.multiplier - (is_open ? step.multiplier : T{}));
  }
  return false;
}

/// The result for a multiplier, without regard to the yield surface: z falls with L, and hardening gives
/// w = ln(1 + L / (m H)) = z - chi psi_i / M_i, between 0 and its value at L = 0.
inline Result<double> hardened(const Start<double>& a, double m, bool vertex = false)
{
  const double scale = m * a.sand.hardening;
  const auto most = [&](double image_growth) // ln of p_max / p_i
  {
    const Image<double> image = image_of(a.sand, a.psi + a.sand.compression * image_growth);
    return (a.trial_log() - image_growth) / (1 + a.sand.bulk * m * image.slope) - image.limit;
  };
  const double end = most(0);
  const auto gap = [&](double w) { return w - most(scale * std::expm1(w)); };
  const double w = m > 0 && end != 0 ? root_between(gap, {0, -end}, {end, gap(end)}) : 0;
  return result_of<double>(a, scale * std::expm1(w), m, vertex);
}

/// The largest bracket [lower, upper] of a function that falls from positive values, by doubling
template <class F>
double root_above(F&& f, double lower, double step)
{
  Sample one{lower, f(lower)};
  for (int doubling = 0; doubling < 100; ++doubling, step *= 2)
  {
    const Sample other{one.x + step, f(one.x + step)};
    if (other.f <= 0)
      return root_between(f, one, other);
    one = other;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// The same by brackets in the multiplier. Beyond the vertex the return goes to it, unless its cone of plastic strains,
/// g de_v^p >= M_i de_q^p, does not have the one that takes all of q away.
inline Result<double> bracketed(const Start<double>& a)
{
  double lower = 0;
  if (const double beyond = a.trial_log() - 1; beyond > 0)
  {
    const double step = beyond / (a.sand.bulk * a.sand.slope);
    lower = root_above([&](double m) { return hardened(a, m).log - 1; }, 0, step);
    const Result<double> vertex = hardened(a, lower, true);
    if (!(vertex.trial.q > 3 * vertex.trial.shear * vertex.trial.factor * lower))
      return vertex;
  }
  const Result<double> start = hardened(a, lower);
  const double g = start.trial.factor;
  const double step = std::max(excess(start) * start.pressure / (3 * start.trial.shear * g * g), 1e-12);
  return hardened(a, root_above([&](double m) { return excess(hardened(a, m)); }, lower, step));
}
} // namespace mpm::materials::nor_sand
