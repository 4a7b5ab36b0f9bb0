#pragma once
/// @file
/// Pressures of unsaturated soil whose cell comes to rest or turns into particles: its water stays as it is.

#include "materials/tools/root.h"
#include "model/retention.h"

#include <algorithm>
#include <span>

namespace mpm::model
{
/// What is to be added to pressures so that the soil has a mean saturation: their own would differ from it, as the
/// curve of retention is no straight line.
/// @param weights  of the means
/// @param least, largest  pressures [Pa] that the saturation lies between
inline double holding_shift(const Retention& retention, double saturation, std::span<const double> pressures,
                            std::span<const double> weights, double least, double largest)
{
  const auto excess = [&](double shift)
  {
    double sum = -saturation;
    for (std::size_t k = 0; k < pressures.size(); ++k)
      sum += weights[k] * wetness_at(retention, pressures[k] + shift).saturation;
    return sum;
  };
  const auto [lowest, highest] = std::ranges::minmax(pressures);
  const double down = least - highest, up = largest - lowest; // all pressures are below, and above, the wanted one
  const double fall = excess(down), rise = excess(up);
  if (std::abs(excess(0)) < 1e-14 || !(fall < 0 && rise > 0))
    return 0;
  return materials::root_between(excess, {down, fall}, {up, rise});
}
} // namespace mpm::model
