#pragma once
/// @file
/// Water in the pores of the soil: what a model knows of it beside the columns of its particles.

#include "base/tensor.h"
#include "base/types.h"
#include "model/retention.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>
#include <vector>

namespace mpm::model
{
/// Values over time, rising, joined by straight lines; before the first and after the last time the end values hold.
using TimeTable = std::vector<std::pair<double, double>>;

inline double value_at(const TimeTable& history, double time)
{
  const auto after = std::ranges::upper_bound(history, time, {}, &TimeTable::value_type::first);
  if (after == history.begin() || after == history.end())
    return after == history.end() ? history.back().second : after->second;
  const auto& [t0, a] = *(after - 1);
  const auto& [t1, b] = *after;
  return a + (b - a) * (time - t0) / (t1 - t0);
}

/// A pressure on tagged facets: value + slope x_D with the last coordinate; where it has a slope, at least zero.
struct PressureCondition
{
  Index facet_tag;
  TimeTable value; ///< [Pa]
  double slope;    ///< [Pa/m]
  bool held;       ///< whether the pore water has this pressure at the nodes there
  bool presses;    ///< whether this pressure loads the surface of the soil, as a total stress
};

struct PoreWater
{
  double unit_weight = 9810;  ///< gamma_w [N/m3]
  double modulus = 2.2e9;     ///< K_w [Pa], may be infinite
  bool kozeny_carman = false; ///< whether the conductivity follows the porosity n as n^3 / (1 - n)^2
  double suction_limit = std::numeric_limits<double>::infinity(); ///< below that pores are not full; explicit runs [Pa]
  bool drained_surface = false; ///< whether the pressure is zero at the free surface, wherever that is
  std::vector<PressureCondition> conditions;
  std::vector<Matrix<3>> anisotropy; ///< of each law: tensor of the conductivity over k; none where one
  std::vector<Retention> retention;  ///< of the soil of each law; none where all soil stays saturated
  TimeTable standing;                ///< level of water that stands over the free surface [m]; none without such water
  TimeTable rain;                    ///< on the free surface above that water, per horizontal area [m/s]; likewise
  double inflow = 0;                 ///< water that has entered at the nodes of this rank since the start [m3]
  double time = 0;                   ///< for which loads and levels are wanted: the end of an implicit step [s]

  bool may_dry() const { return !retention.empty(); }
};

/// Pressure of the water that stands over the soil, at a height [Pa].
inline double standing_pressure(const PoreWater& water, double height)
{
  return water.standing.empty() ? 0.0
                                : std::max(0.0, water.unit_weight * (value_at(water.standing, water.time) - height));
}

/// Gravity by which the unit weight of water is its density [m/s2].
inline constexpr double standard_gravity = 9.81;

inline double pressure_at(const PressureCondition& condition, double height, double time)
{
  const double pressure = value_at(condition.value, time) + condition.slope * height;
  return condition.slope == 0 || pressure > 0 ? pressure : 0;
}
} // namespace mpm::model
