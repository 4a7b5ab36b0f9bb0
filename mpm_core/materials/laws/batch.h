#pragma once
/// @file
/// What a constitutive law is given and what it gives back.

#include "base/lanes.h"

#include <limits>
#include <string_view>
#include <utility>

namespace mpm::materials
{
/// Most state variables that a law may have
inline constexpr int max_states = 73;

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
  /// Time at the start of the increment [s]
  double time = 0;
  /// Duration of the increment [s]; infinite where loading is taken as slow without limit, as in steps of finite
  /// elements without a duration
  double dt = std::numeric_limits<double>::infinity();
  /// Size of each point's cell [m], see `cell_size` in mesh/mesh.h; null where there is no cell, or no law needs it
  const double* cell_size = nullptr;
  /// Increment of the deformation gradient, F = 1 + grad u from the increment's start to its end, one column per entry,
  /// row by row. Null stands for 1 + strain increment: small displacements, or no law needs it
  std::array<const double*, D * D> deformation{};
};

/// Stress and strain increment of a point as tensors, or of a few points from there on
template <int D, class T = double>
auto tensors_of(const PointBatch<D>& points, Index i)
{
  std::pair<std::array<T, n_stress<D>>, std::array<T, n_stress<D>>> tensors;
  auto& [stress, strain] = tensors;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    stress[k] = load_as<T>(points.stress[k] + i);
    strain[k] = load_as<T>(points.strain_increment[k] + i) * (k < 3 ? 1 : 0.5); // engineering shear to components
  }
  return tensors;
}

/// What of a batch a law needs beyond what all are given, so that it is not worked out for others.
struct Needs
{
  bool cell_size = false;
  bool deformation = false;
};

/// Points [first, first + size) of a batch as a batch of their own, in the same columns. It points into itself, so it
/// is not copied.
template <int D>
struct BatchSlice
{
  BatchSlice(const PointBatch<D>& points, Index first, Index size, int n_state) : batch(points)
  {
    constexpr auto entries = static_cast<std::size_t>(n_stress<D> * n_stress<D>);
    batch.size = size;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
    {
      batch.strain_increment[k] += first;
      batch.stress[k] += first;
    }
    for (int k = 0; k < n_state; ++k)
      state[static_cast<std::size_t>(k)] = points.state[k] + first;
    batch.state = state.data();
    if (points.tangent)
      batch.tangent += static_cast<std::size_t>(first) * entries;
    if (points.cell_size)
      batch.cell_size += first;
    if (points.deformation.front())
      for (const double*& column : batch.deformation)
        column += first;
  }
  BatchSlice(const BatchSlice&) = delete;
  BatchSlice& operator=(const BatchSlice&) = delete;

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
} // namespace mpm::materials
