#pragma once
/// @file
/// What a constitutive law is given and what it gives back.

#include "base/types.h"

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

/// What happened in a batch. Reports of several batches are merged with `+=`.
struct BatchReport
{
  /// Points that yielded in this increment
  Index plastic = 0;
  /// Points whose update failed (not finite, or an iteration that did not converge); their stress is left as it was
  Index failed = 0;
  /// The first of them, or -1
  Index first_failed = -1;
};
} // namespace mpm
