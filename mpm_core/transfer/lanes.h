#pragma once
/// @file
/// Loops over a run of particles in pieces of constant length, which the compiler turns into a few vector instructions
/// without a scalar remainder. With some ten particles in a cell, the remainder would cost as much as all the rest.

#include "base/types.h"

#include <algorithm>

namespace mpm
{
/// Particles that a kernel treats at once: one vector register of AVX-512, two of AVX2, four of SSE2 or NEON.
inline constexpr int lanes = 8;

/// Calls `kernel(at, first)` on pieces of `lanes` entries of the columns [first, last): `at` is where the piece begins
/// in each column, and only the lanes from `first` on are to be written or counted. The last piece reaches back over
/// entries before it.
template <std::size_t N, class Kernel>
inline void for_each_lanes(const std::array<double*, N>& columns, Index first, Index last, Kernel&& kernel)
{
  std::array<double*, N> at;
  Index i = first;
  for (; i + lanes <= last; i += lanes)
  {
    for (std::size_t k = 0; k < N; ++k)
      at[k] = columns[k] + i;
    kernel(at, 0);
  }
  const int rest = static_cast<int>(last - i);
  if (rest == 0)
    return;
  if (last >= lanes)
  {
    for (std::size_t k = 0; k < N; ++k)
      at[k] = columns[k] + (last - lanes);
    kernel(at, lanes - rest);
    return;
  }
  // The first particles of all, with too few entries before them: they are brought together elsewhere.
  std::array<std::array<double, lanes>, N> copy{};
  for (std::size_t k = 0; k < N; ++k)
  {
    std::copy_n(columns[k] + i, rest, copy[k].end() - rest);
    at[k] = copy[k].data();
  }
  kernel(at, lanes - rest);
  for (std::size_t k = 0; k < N; ++k)
    std::copy_n(copy[k].end() - rest, rest, columns[k] + i);
}
} // namespace mpm
