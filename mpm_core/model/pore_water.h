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

/// A pressure on tagged facets, or the level of water that stands against them.
struct PressureCondition
{
  Index facet_tag;
  TimeTable value; ///< pressure [Pa], or level along the last axis [m]
  bool is_level;
  bool held;    ///< whether the pore water has this pressure at the nodes there
  bool presses; ///< whether this pressure loads the surface of the soil, as a total stress
};

struct PoreWater
{
  double density = 1000;      ///< rho_w, of water without pressure [kg/m3]
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
  double gravity = 0;                ///< downwards along the last axis, at that time [m/s2]

  bool may_dry() const { return !retention.empty(); }
};

/// Gravity under which conductivities are measured [m/s2].
inline constexpr double laboratory_gravity = 9.81;

/// Unit weight gamma_w of water where conductivities k are measured [N/m3]; k / gamma_w depends on no gravity.
inline double laboratory_weight(const PoreWater& water) { return water.density * laboratory_gravity; }

/// Pressure at a height, under water that stands up to a level [Pa].
inline double pressure_below(const PoreWater& water, double level, double height)
{
  return std::max(0.0, water.density * water.gravity * (level - height));
}

/// Pressure of the water that stands over the soil, at a height [Pa].
inline double standing_pressure(const PoreWater& water, double height)
{
  return water.standing.empty() ? 0.0 : pressure_below(water, value_at(water.standing, water.time), height);
}

inline double pressure_at(const PressureCondition& condition, const PoreWater& water, double height)
{
  const double value = value_at(condition.value, water.time);
  return condition.is_level ? pressure_below(water, value, height) : value;
}
} // namespace mpm::model
