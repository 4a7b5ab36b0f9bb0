#pragma once
/// @file
/// The return of NorSand to its yield surface: three equations for the pressure, the image pressure and the plastic
/// multiplier at the end of an increment, by Newton's method, and by brackets where that fails.

#include "base/eigen.h"
#include "materials/laws/nor_sand.h"
#include "materials/tools/lode.h"
#include "materials/tools/root.h"
#include "materials/tools/secant.h"

#include <array>
#include <limits>
#include <optional>

namespace mpm::materials::nor_sand
{
/// A point at the start of an increment: pressures and volumetric strains are positive in compression here
template <int D>
struct Start
{
  const NorSand& law;
  double bulk = 0;         ///< K / p
  double extension = 0;    ///< b, see `extension_of`
  double least = 0;        ///< pressure that is kept at least [Pa]
  double pressure = 0;     ///< p
  double image = 0;        ///< p_i
  double log = 0;          ///< ln(p / p_i)
  double volumetric = 0;   ///< volumetric strain increment
  double volume = 0;       ///< specific volume at the end
  double psi = 0;          ///< psi_i with the void ratio of the end and the image pressure of the start
  SymTensor<D> deviator{}; ///< of the stress
  SymTensor<D> strain{};   ///< deviatoric strain increment, tensor components

  /// ln(p / p_i) after an elastic increment
  double trial_log() const { return log + bulk * volumetric; }
};

/// b = g^4 of triaxial extension
inline double extension_of(const NorSand& law)
{
  const double square = (1 + law.critical_slope / 3) * (1 + law.critical_slope / 3);
  return square * square;
}

template <int D>
Start<D> start_of(const NorSand& law, const PointBatch<D>& points, Index i)
{
  const auto [stress, strain] = tensors_of(points, i);
  Start<D> a{law, bulk_per_pressure(law), extension_of(law)};
  a.least = 1e-6 * (law.reference_pressure + law.attraction);
  a.pressure = law.attraction - mean<D>(stress);
  a.image = (law.image_pressure + law.attraction) * std::exp(points.state[1][i]);
  a.log = std::log(a.pressure / a.image);
  a.volumetric = -3 * mean<D>(strain);
  a.volume = (1 + law.void_ratio) * std::exp(points.state[2][i] - a.volumetric);
  a.psi =
      a.volume - 1 - law.critical_void_ratio + law.critical_compression * std::log(a.image / law.reference_pressure);
  a.deviator = deviator<D>(stress);
  a.strain = deviator<D>(strain);
  return a;
}

/// What the image pressure at the end of an increment decides
struct Image
{
  double slope, slope_by_psi; ///< M_i of triaxial compression
  double limit, limit_by_psi; ///< chi psi_i / M_i, at most 1: then not even z = 1, at the vertex, softens
};

inline Image image_of(const NorSand& law, double psi)
{
  const double fall = law.coupling * law.dilatancy, least = law.critical_slope / 2;
  const double slope = law.critical_slope - fall * std::abs(psi);
  Image image{std::max(slope, least), slope > least ? (psi > 0 ? -fall : fall) : 0, 0, 0};
  image.limit = std::min(law.dilatancy * psi / image.slope, 1.0);
  image.limit_by_psi = image.limit < 1 ? (law.dilatancy - image.limit * image.slope_by_psi) / image.slope : 0;
  return image;
}

/// The direction of a deviator in the deviatoric plane, which its return keeps
struct Direction
{
  double lode;   ///< cos(3 theta)
  double factor; ///< g = M / M(theta), by which q counts more than in triaxial compression
};

template <int D>
Direction direction_of(const Start<D>& a, const SecantTrial<D>& trial)
{
  const double lode = lode_cosine<D>(trial.deviator, trial.q);
  return {lode, std::sqrt(std::sqrt(0.5 * (1 + a.extension - (a.extension - 1) * lode)))};
}

/// Derivative of g by the trial deviator
template <int D>
SymTensor<D> factor_by_deviator(const Start<D>& a, const SecantTrial<D>& trial, const Direction& direction)
{
  const double by_lode = (1 - a.extension) / (8 * direction.factor * direction.factor * direction.factor);
  SymTensor<D> slope = lode_cosine_slope<D>(trial.deviator, trial.q, direction.lode);
  for (double& component : slope)
    component *= by_lode;
  return slope;
}

/// The end of an increment by its three unknowns
template <int D>
struct Result
{
  double growth;       ///< y = ln of p over that of the start
  double image_growth; ///< L = ln of p_i over that of the start
  double multiplier;   ///< m = de_q^p / g
  bool vertex;         ///< whether q = 0, where the surface meets the axis
  double log;          ///< z = ln(p / p_i): g D = M_i z and g q / p = M_i (1 - z)
  Image image;
  double pressure;
  SecantTrial<D> trial;
  double shear_per_pressure; ///< G of the increment over p of its end
  Direction direction;

  /// Of the deviator to that of the trial: by the yield surface, since the trial may be larger by many digits
  double ratio() const
  {
    return vertex ? 0 : multiplier > 0 ? image.slope * (1 - log) * pressure / (direction.factor * trial.q) : 1;
  }
};

template <int D>
Result<D> result_of(const Start<D>& a, double growth, double image_growth, double multiplier, bool vertex = false)
{
  Result<D> r{growth, image_growth, multiplier, vertex, 0, {}, 0, {}, 0, {}};
  r.log = a.log + growth - image_growth;
  r.image = image_of(a.law, a.psi + a.law.critical_compression * image_growth);
  r.pressure = a.pressure * std::exp(growth);
  r.trial = secant_trial<D>(a.law.rigidity * a.pressure * mean_growth(growth), a.deviator, a.strain);
  r.shear_per_pressure = r.trial.shear / r.pressure;
  r.direction = direction_of(a, r.trial);
  return r;
}

/// g q of the trial less the plastic strain's, less that of the yield surface, over p: the yield function where m is 0
template <int D>
double excess(const Result<D>& r)
{
  const double g = r.direction.factor;
  return g * (r.trial.q / r.pressure - 3 * r.shear_per_pressure * g * r.multiplier) - r.image.slope * (1 - r.log);
}

/// Its derivative by g
template <int D>
double excess_by_factor(const Result<D>& r)
{
  return r.trial.q / r.pressure - 6 * r.shear_per_pressure * r.direction.factor * r.multiplier;
}

/// Derivative of g by G of the trial
template <int D>
double factor_by_shear(const Start<D>& a, const Result<D>& r)
{
  return 2 * product<D>(factor_by_deviator(a, r.trial, r.direction), a.strain);
}

/// The three equations of a plastic increment, all without unit: volumetric strain, hardening and yield surface
template <int D>
Eigen::Vector3d residual(const Start<D>& a, const Result<D>& r)
{
  const double m = r.multiplier, hardening = std::expm1(r.log - r.image.limit);
  return {r.growth - a.bulk * (a.volumetric - m * r.image.slope * r.log),
          r.image_growth - m * a.law.hardening * hardening, r.vertex ? r.log - 1 : excess(r)};
}

/// Derivatives of the equations by y, L and m
template <int D>
Eigen::Matrix3d jacobian(const Start<D>& a, const Result<D>& r)
{
  const double m = r.multiplier, lambda = a.law.critical_compression, slope = r.image.slope, z = r.log;
  const double slope_by_image = r.image.slope_by_psi * lambda;
  const double hardening = a.law.hardening * std::exp(z - r.image.limit);
  const double shear_by_growth = a.law.rigidity * a.pressure * mean_growth_slope(r.growth);
  const double g = r.direction.factor;
  const double q_by_growth = (q_by_shear<D>(r.trial, a.strain) * shear_by_growth - r.trial.q) / r.pressure +
                             3 * a.law.rigidity * mean_growth_slope(-r.growth) * g * m;
  const double excess_by_growth = g * q_by_growth + excess_by_factor(r) * factor_by_shear(a, r) * shear_by_growth;
  Eigen::Matrix3d by;
  by.row(0) << 1 + a.bulk * m * slope, a.bulk * m * (slope_by_image * z - slope), a.bulk * slope * z;
  by.row(1) << -m * hardening, 1 + m * hardening * (1 + r.image.limit_by_psi * lambda), a.law.hardening - hardening;
  if (r.vertex)
    by.row(2) << 1, -1, 0;
  else
    by.row(2) << excess_by_growth + slope, -slope_by_image * (1 - z) - slope, -3 * r.shear_per_pressure * g * g;
  return by;
}

/// Newton's method from the elastic result; nothing where it does not find a result that makes sense
template <int D>
std::optional<Result<D>> newton(const Start<D>& a, Result<D> r)
{
  const double tolerance = 1e-13 * (1 + std::abs(r.growth) + r.trial.q / r.pressure);
  for (int iteration = 0; iteration < 15; ++iteration)
  {
    const Eigen::Vector3d error = residual(a, r);
    if (!error.allFinite())
      return {};
    if (error.cwiseAbs().maxCoeff() <= tolerance)
      return r.multiplier > 0 && r.log <= 1 ? std::optional(r) : std::nullopt;
    const Eigen::Vector3d step = jacobian(a, r).inverse() * error;
    r = result_of(a, r.growth - step[0], r.image_growth - step[1], r.multiplier - step[2]);
  }
  return {};
}

/// The result for a multiplier, without regard to the yield surface: volumetric strain gives z, falling with L, as
/// (z_trial - L) / (1 + K/p m M_i), and then hardening gives w = ln(1 + L / (m H)) = z - chi psi_i / M_i, between 0 and
/// its value at L = 0.
template <int D>
Result<D> hardened(const Start<D>& a, double m, bool vertex = false)
{
  const double scale = m * a.law.hardening, trial = a.trial_log();
  const auto logs = [&](double image_growth) -> std::array<double, 2>
  {
    const Image image = image_of(a.law, a.psi + a.law.critical_compression * image_growth);
    const double z = (trial - image_growth) / (1 + a.bulk * m * image.slope);
    return {z, z - image.limit};
  };
  const double end = logs(0)[1];
  const auto gap = [&](double w) { return w - logs(scale * std::expm1(w))[1]; };
  const double w = m > 0 && end != 0 ? root_between(gap, {0, -end}, {end, gap(end)}) : 0;
  const double image_growth = scale * std::expm1(w);
  return result_of(a, logs(image_growth)[0] + image_growth - a.log, image_growth, m, vertex);
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
template <int D>
Result<D> bracketed(const Start<D>& a)
{
  double lower = 0;
  if (const double beyond = a.trial_log() - 1; beyond > 0)
  {
    const double step = beyond / (a.bulk * a.law.critical_slope);
    lower = root_above([&](double m) { return hardened(a, m).log - 1; }, 0, step);
    const Result<D> vertex = hardened(a, lower, true);
    if (!(vertex.trial.q > 3 * vertex.trial.shear * vertex.direction.factor * lower))
      return vertex;
  }
  const Result<D> start = hardened(a, lower);
  const double g = start.direction.factor;
  const double step = std::max(excess(start) / (3 * start.shear_per_pressure * g * g), 1e-12);
  return hardened(a, root_above([&](double m) { return excess(hardened(a, m)); }, lower, step));
}
} // namespace mpm::materials::nor_sand
