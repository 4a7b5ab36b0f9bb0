#pragma once
/// @file
/// Water in the pores of the soil: what a model knows of it beside the columns of its particles.

#include "base/types.h"

#include <limits>
#include <vector>

namespace mpm::model
{
/// A pressure on tagged facets: value + slope x_D with the last coordinate; where it has a slope, at least zero.
struct PressureCondition
{
  Index facet_tag;
  double value; ///< [Pa]
  double slope; ///< [Pa/m]
  bool held;    ///< whether the pore water has this pressure at the nodes there
  bool presses; ///< whether this pressure loads the surface of the soil, as a total stress
};

struct PoreWater
{
  double unit_weight = 9810;  ///< gamma_w [N/m3]
  double modulus = 2.2e9;     ///< K_w [Pa], may be infinite
  bool kozeny_carman = false; ///< whether the conductivity follows the porosity n as n^3 / (1 - n)^2
  double suction_limit = std::numeric_limits<double>::infinity(); ///< below that pores are not full; explicit runs [Pa]
  bool drained_surface = false; ///< whether the pressure is zero at the free surface, wherever that is
  std::vector<PressureCondition> conditions;
  double inflow = 0; ///< water that has entered at the nodes of this rank since the start [m3]
};

/// Gravity by which the unit weight of water is its density [m/s2].
inline constexpr double standard_gravity = 9.81;

inline double pressure_at(const PressureCondition& condition, double height)
{
  const double pressure = condition.value + condition.slope * height;
  return condition.slope == 0 || pressure > 0 ? pressure : 0;
}
} // namespace mpm::model
