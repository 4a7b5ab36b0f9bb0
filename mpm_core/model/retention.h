#pragma once
/// @file
/// How much water unsaturated soil holds and lets through, over its suction.

#include <array>
#include <vector>

namespace mpm::model
{
/// Monotone curves over the suction, cubic between its points (Fritsch and Carlson 1980); the last values hold beyond.
/// Without points soil is saturated under any suction.
struct Retention
{
  /// Degree of saturation S, effective one S_e, relative permeability k_r
  static constexpr std::size_t n_curves = 3;
  std::vector<double> suction;                      ///< rising from 0 [Pa]
  std::array<std::vector<double>, n_curves> values; ///< falling from 1 [-]
  std::array<std::vector<double>, n_curves> slopes; ///< their derivatives [1/Pa]
};

/// The curves at a pressure, and their derivatives by it.
struct Wetness
{
  double saturation = 1, effective = 1, permeability = 1;          ///< [-]
  double by_saturation = 0, by_effective = 0, by_permeability = 0; ///< [1/Pa]
};

Wetness wetness_at(const Retention& retention, double pressure);

/// Part of the pore pressure that the total stress has, S_e p (Bishop 1959).
inline double acting_pressure(const Retention& retention, double pressure)
{
  return pressure < 0 ? wetness_at(retention, pressure).effective * pressure : pressure;
}
} // namespace mpm::model
