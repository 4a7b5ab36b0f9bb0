#pragma once
/// @file
/// Batches of laws whose returns iterate: a few points side by side where all of them go the common way, else one by
/// one. A single point would keep the processor waiting for one result after another.

#include "base/lanes.h"
#include "materials/laws/batch.h"
#include "materials/tools/deviator.h"

#include <optional>

namespace mpm::materials
{
/// What became of a point
enum class Outcome
{
  elastic,
  plastic,
  failed
};

/// Updates a batch.
/// @param few  `few(i)` updates the points from i on, as many as there are `lanes`, to the last bit as `one` does, and
///             returns how many of them yielded; or it changes nothing and returns nothing. Not called for tangents.
/// @param one  `one(i, tangent)` updates a point, and its tangent where that is not null; it may fail
template <int D, class Few, class One>
BatchReport update_side_by_side(const PointBatch<D>& points, Few&& few, One&& one)
{
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  BatchReport report;
  for (Index i = 0; i < points.size;)
  {
    const bool enough = !points.tangent && i + lanes <= points.size;
    if (const std::optional<Index> plastic = enough ? few(i) : std::nullopt)
    {
      report.plastic += *plastic;
      i += lanes;
      continue;
    }
    for (const Index end = std::min(i + lanes, points.size); i < end; ++i)
    {
      double* const tangent = points.tangent ? points.tangent + static_cast<std::size_t>(i) * entries : nullptr;
      const Outcome outcome = one(i, tangent);
      report.plastic += outcome == Outcome::plastic ? 1 : 0;
      if (outcome != Outcome::failed)
        continue;
      report.failed.push_back(i);
      if (tangent)
        std::fill_n(tangent, entries, 0.0);
    }
  }
  return report;
}

/// Number of points for which a mask holds
inline Index count(const LaneMask& mask) { return static_cast<Index>(-(mask[0] + mask[1] + mask[2] + mask[3])); }

/// The deviators of a point, or of a few, whose returns work with their invariants alone
template <int D, class T>
struct Deviators
{
  std::array<T, n_stress<D>> stress; ///< at the start
  std::array<T, n_stress<D>> strain; ///< increment, tensor components
};

/// Writes mean 1 + ratio (s + 2 G e).
template <int D, class T>
void write_stress(const PointBatch<D>& points, Index i, const T& mean, const T& ratio, const T& shear,
                  const Deviators<D, T>& deviators)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    const T deviator = ratio * (deviators.stress[k] + 2 * shear * deviators.strain[k]);
    store(k < 3 ? deviator + mean : deviator, points.stress[k] + i);
  }
}

/// Adds to a state.
template <int D, class T>
void add_to_state(const PointBatch<D>& points, Index i, std::size_t k, const T& change)
{
  store(load_as<T>(points.state[k] + i) + change, points.state[k] + i);
}
} // namespace mpm::materials
