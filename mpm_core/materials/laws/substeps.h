#pragma once
/// @file
/// A second chance for points whose update failed.

#include "materials/laws/law.h"

namespace mpm::materials
{
/// Most parts that a strain increment is cut into.
inline constexpr int most_parts = 64;

/// Updates the points of a batch whose update failed once more, with their strain increments cut into 2, 4, 8, ...,
/// `most_parts` equal parts, as far as it takes. For updates without a tangent: the parts have one each, and the whole
/// has none.
/// Source: Sloan (1987), IJNME 24, 893-911 (substepping; here it is a failure, not an error estimate, that cuts).
/// @param failed  the points, as they were before the increment
/// @returns how many of them yielded, and those that failed to the end, which are as they were
template <int D>
BatchReport update_in_parts(const Law& law, const PointBatch<D>& points, const std::vector<Index>& failed);
} // namespace mpm::materials
