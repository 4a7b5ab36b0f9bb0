#pragma once
/// @file
/// The rate equations of SANISAND, for points as stresses have them: deviators positive in tension, pressures and
/// volumetric strains in compression.

#include "materials/laws/sanisand.h"
#include "materials/tools/lode.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mpm::materials::sanisand
{
inline const double root_2_3 = std::sqrt(2.0 / 3);

/// Constants of a law
struct Sand
{
  const Sanisand& law;
  double bulk;           ///< K / G
  double radius;         ///< of the yield surface in ratios of stress, sqrt(2/3) m
  double least;          ///< pressure that is kept at least [Pa]
  double least_distance; ///< from the last reversal
};

inline Sand sand_of(const Sanisand& law)
{
  const double radius = root_2_3 * law.yield_size;
  return {law, bulk_per_shear(law), radius, Sanisand::least_pressure, 0.1 * radius};
}

/// G / sqrt(p) at a void ratio; loosened beyond 2, soil keeps the stiffness of 2, since (2.97 - e)^2 would rise again
inline double shear_per_root(const Sanisand& law, double void_ratio)
{
  const double e = std::min(void_ratio, 2.0);
  return law.rigidity * std::sqrt(Sanisand::atmospheric_pressure) * (2.97 - e) * (2.97 - e) / (1 + e);
}

/// What an increment changes of a point, or rates of it
template <int D>
struct Point
{
  double pressure = 0;
  SymTensor<D> deviator{}, back{}, fabric{}; ///< s, alpha and z
  double plastic = 0;                        ///< accumulated plastic deviatoric strain
  double fraction = 0;                       ///< of the increment that has been taken
};

/// An increment of strain
template <int D>
struct Strain
{
  SymTensor<D> deviator; ///< tensor components
  double volumetric;     ///< positive in compression
};

template <int D>
SymTensor<D> scaled(double factor, SymTensor<D> a)
{
  for (double& component : a)
    component *= factor;
  return a;
}

/// a + factor b
template <int D>
SymTensor<D> sum(SymTensor<D> a, double factor, const SymTensor<D>& b)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    a[k] += factor * b[k];
  return a;
}

template <int D>
double norm(const SymTensor<D>& a)
{
  return std::sqrt(product<D>(a, a));
}

/// An increment of a point
template <int D>
struct Increment
{
  Strain<D> strain;
  double volume;         ///< 1 + e at its start
  SymTensor<D> reversal; ///< alpha_in

  double void_ratio(double fraction) const { return volume * std::exp(-fraction * strain.volumetric) - 1; }
};

/// r - alpha, whose length is `Sand::radius` on the yield surface
template <int D>
SymTensor<D> from_back(const Point<D>& point)
{
  return sum<D>(scaled<D>(1 / point.pressure, point.deviator), -1, point.back);
}

/// Elastic part of an increment, along which p follows the strain exactly: sqrt(p) is linear in it.
template <int D>
struct ElasticPath
{
  Point<D> start;
  Strain<D> strain;
  double shear_per_root, bulk_per_root, root;

  ElasticPath(const Sand& sand, const Point<D>& point, const Strain<D>& increment, double void_ratio)
      : start(point), strain(increment), shear_per_root(sanisand::shear_per_root(sand.law, void_ratio)),
        bulk_per_root(sand.bulk * shear_per_root), root(std::sqrt(point.pressure))
  {
  }

  /// The point after a fraction of the increment, with at least the square of `least_root` as its pressure
  Point<D> at(double fraction, double least_root) const
  {
    Point<D> point = start;
    point.fraction = fraction;
    const double end = std::max(root + 0.5 * fraction * bulk_per_root * strain.volumetric, least_root);
    point.pressure = end * end;
    point.deviator = sum<D>(point.deviator, fraction * shear_per_root * (root + end), strain.deviator);
    return point;
  }
};

/// The directions and distances that the plastic strain of a point follows from
template <int D>
struct Loading
{
  SymTensor<D> n;
  double lode, slope; ///< cos(3 theta) and g of n
  double shear;       ///< G
  double ratio;       ///< n : r
  double bounding;    ///< sqrt(2/3) (g M exp(-n_b psi) - m)
  double to_bounding, to_dilatancy;
};

template <int D>
Loading<D> loading(const Sand& sand, const Point<D>& point, double void_ratio)
{
  const Sanisand& law = sand.law;
  Loading<D> at;
  const SymTensor<D> ratio = scaled<D>(1 / point.pressure, point.deviator), beyond = sum<D>(ratio, -1, point.back);
  at.n = scaled<D>(1 / std::max(norm<D>(beyond), 1e-300), beyond);
  at.lode = lode_cosine(-13.5 * determinant<D>(at.n), std::sqrt(1.5));
  const double c = law.extension_ratio;
  at.slope = 2 * c / (1 + c - (1 - c) * at.lode);
  at.shear = shear_per_root(law, void_ratio) * std::sqrt(point.pressure);
  at.ratio = product<D>(at.n, ratio);
  const double relative = point.pressure / Sanisand::atmospheric_pressure;
  const double psi =
      void_ratio - law.critical_void_ratio + law.critical_compression * std::pow(relative, law.critical_exponent);
  const double slope = at.slope * law.critical_slope, along = product<D>(at.n, point.back);
  at.bounding = root_2_3 * (slope * std::exp(-law.bounding_exponent * psi) - law.yield_size);
  at.to_bounding = at.bounding - along;
  at.to_dilatancy = root_2_3 * (slope * std::exp(law.dilatancy_exponent * psi) - law.yield_size) - along;
  return at;
}

/// How far an increment loads a point on its yield surface: n : ds - n : r dp of an elastic increment, over 2 G
/// @param bulk  K / G
template <int D>
double load(const Loading<D>& at, const Strain<D>& strain, double bulk)
{
  return product<D>(at.n, strain.deviator) - 0.5 * at.ratio * bulk * strain.volumetric;
}

/// b_0 of the hardening; soil looser than 1 / c_h keeps some
inline double hardening_scale(const Sanisand& law, double pressure, double void_ratio)
{
  return law.rigidity * law.hardening * std::max(1 - law.hardening_void_ratio * void_ratio, 0.01) /
         std::sqrt(pressure / Sanisand::atmospheric_pressure);
}

/// h of the hardening. At a reversal it is infinite; within a tenth of the radius of the yield surface from it, plastic
/// strains are below a hundredth of elastic ones in any case.
template <int D>
double hardening(const Sand& sand, const Point<D>& point, const SymTensor<D>& reversal, const Loading<D>& at,
                 double void_ratio)
{
  const double since = product<D>(at.n, sum<D>(point.back, -1, reversal));
  return hardening_scale(sand.law, point.pressure, void_ratio) /
         std::max({since, -at.to_bounding, sand.least_distance});
}

/// Rates of a point on its yield surface, over the fraction of an increment
template <int D>
Point<D> rates(const Sand& sand, const Increment<D>& increment, const Point<D>& point)
{
  const Sanisand& law = sand.law;
  const Strain<D>& strain = increment.strain;
  const double void_ratio = increment.void_ratio(point.fraction);
  const Loading<D> at = loading<D>(sand, point, void_ratio);
  const double h = hardening<D>(sand, point, increment.reversal, at, void_ratio);
  const double fabric = std::max(product<D>(point.fabric, at.n), 0.0);
  const double dilatancy = law.dilatancy * (1 + fabric) * at.to_dilatancy;
  const double c = law.extension_ratio, less = (1 - c) / c * at.slope;
  const double along = 1 + 1.5 * less * at.lode, across = 3 * std::sqrt(1.5) * less; // B and C
  SymTensor<D> flow = square<D>(at.n);
  for (std::size_t k = 0; k < 3; ++k)
    flow[k] -= 1.0 / 3;
  flow = sum<D>(scaled<D>(across, flow), along, at.n);

  const double twice = 2 * at.shear;
  const double modulus = 2.0 / 3 * point.pressure * h * at.to_bounding; // K_p
  const double of_flow = twice * product<D>(at.n, flow);
  double bulk = sand.bulk; // over G
  const auto multiplier_of = [&]
  {
    const double resistance = modulus + of_flow - bulk * at.shear * dilatancy * at.ratio;
    return twice * std::max(load(at, strain, bulk), 0.0) / std::max(resistance, 0.01 * twice);
  };
  double multiplier = multiplier_of();
  if (!(point.pressure > sand.least) && strain.volumetric < multiplier * dilatancy)
  {
    bulk = 0; // the pressure stays
    multiplier = multiplier_of();
  }

  Point<D> rate;
  rate.pressure = bulk * at.shear * (strain.volumetric - multiplier * dilatancy);
  rate.deviator = scaled<D>(twice, sum<D>(strain.deviator, -multiplier, flow));
  const double hardened = 2.0 / 3 * multiplier * h;
  rate.back = scaled<D>(hardened, sum<D>(scaled<D>(at.bounding, at.n), -1, point.back));
  const double dilation = law.fabric_rate * std::max(-multiplier * dilatancy, 0.0);
  rate.fabric = scaled<D>(-dilation, sum<D>(point.fabric, law.fabric_limit, at.n));
  rate.plastic = root_2_3 * multiplier * norm<D>(flow);
  rate.fraction = 1;
  return rate;
}

/// Bound of the eigenvalues of the rates. The yield surface is narrow, and its normal turns to the direction of loading
/// within a strain of about its radius times p / (2 G); and alpha is drawn to the bounding surface.
template <int D>
double stiffness_of_rates(const Sand& sand, const Increment<D>& increment, const Point<D>& point)
{
  const double void_ratio = increment.void_ratio(point.fraction);
  const double twice = 2 * shear_per_root(sand.law, void_ratio) / std::sqrt(point.pressure);
  const double hardening = hardening_scale(sand.law, point.pressure, void_ratio) / sand.least_distance;
  const double size = norm<D>(increment.strain.deviator) + sand.bulk * std::abs(increment.strain.volumetric);
  return (2 * twice / sand.radius + hardening) * size;
}
} // namespace mpm::materials::sanisand
