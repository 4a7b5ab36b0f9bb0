#pragma once
/// @file
/// How a rigid surface moves.

#include "base/types.h"

#include <vector>

namespace mpm::contact
{
/// A translation whose velocity is linear in time between given times, and constant before and after.
template <int D>
struct Motion
{
  std::vector<double> times;         ///< rising [s]
  std::vector<Vector<D>> velocities; ///< one for each [m/s]
};

/// Displacement of a motion from one time to a later one [m].
template <int D>
Vector<D> displacement(const Motion<D>& motion, double from, double to);
} // namespace mpm::contact
