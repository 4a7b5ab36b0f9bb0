#pragma once
/// @file
/// What a constitutive law is given and what it gives back.

#include "base/types.h"

#include <string_view>

namespace mpm
{
/// Most state variables that a law may have
inline constexpr int max_states = 64;

/// A batch of points that follow one law: one contiguous column per component, not owned.
template <int D>
struct PointBatch
{
  /// Number of points
  Index size = 0;
  /// Strain increment, engineering shear; shape (components, size)
  std::array<const double*, n_stress<D>> strain_increment{};
  /// Cauchy stress [Pa]: at the start of the increment on entry, at its end on return
  std::array<double*, n_stress<D>> stress{};
  /// State variables, `n_state(law)` columns, updated in place; all zero at the start. Column 0 of every law is the
  /// accumulated plastic deviatoric strain, the sum of sqrt(2/3 de_p : de_p).
  double* const* state = nullptr;
  /// Consistent tangent d stress / d strain, row-major (size, components, components); null if not wanted
  double* tangent = nullptr;
};

/// One point of a batch as a batch of its own, in the same columns. It points into itself, so it is not copied.
template <int D>
struct OnePoint
{
  OnePoint(const PointBatch<D>& points, Index i, int n_state)
  {
    constexpr auto entries = static_cast<std::size_t>(n_stress<D> * n_stress<D>);
    batch.size = 1;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
    {
      batch.strain_increment[k] = points.strain_increment[k] + i;
      batch.stress[k] = points.stress[k] + i;
    }
    for (int k = 0; k < n_state; ++k)
      state[static_cast<std::size_t>(k)] = points.state[k] + i;
    batch.state = state.data();
    batch.tangent = points.tangent ? points.tangent + static_cast<std::size_t>(i) * entries : nullptr;
  }
  OnePoint(const OnePoint&) = delete;
  OnePoint& operator=(const OnePoint&) = delete;

  std::array<double*, max_states> state;
  PointBatch<D> batch;
};

/// What happened in a batch.
struct BatchReport
{
  /// Number of points that yielded in this increment
  Index plastic = 0;
  /// Points whose update failed (not finite, or an iteration that did not converge), in rising order; their stress and
  /// state are left as they were
  std::vector<Index> failed;
};
} // namespace mpm
