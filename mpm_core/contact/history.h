#pragma once
/// @file
/// Vectors that are given over time.

#include "base/types.h"

#include <vector>

namespace mpm::contact
{
/// A vector that is linear in time between given times, and constant before and after.
template <int N>
struct History
{
  std::vector<double> times; ///< rising [s]
  std::vector<Vector<N>> values;
};

/// Mean of a vector from one time to a later one.
template <int N>
Vector<N> mean(const History<N>& history, double from, double to);

/// A vector at a time.
template <int N>
Vector<N> value_at(const History<N>& history, double time);
} // namespace mpm::contact
