#pragma once
/// @file
/// How a triangulated surface rises around each of its triangles: where it rises little, a point over the inside of a
/// triangle needs no search for other triangles that are nearer.
///
/// Up to the distance R from a triangle T, all of the surface is beyond one of the sides k of T and no higher over the
/// plane of T than r_k u + u^2 / (2 R), where u is its distance from the side in that plane. Let a point be at the
/// height d over a place in T that is e_k away from the sides. A ball of the radius l <= d around it reaches down to d
/// - sqrt(l^2 - s^2) >= d - l + s^2 / (2 l) at the distance s = e_k + u from there or farther. With d + l < R it does
/// not meet the rest of the surface if, for all sides and all u >= 0,
///
///     d - l + e_k^2 / (2 l) + u (e_k / l - r_k) + u^2 / 2 (1 / l - 1 / R) > 0,
///
/// so that with l = d all other triangles are farther away than T, and with l < d all of them than l. Over a place that
/// is a beside T, s >= u - a, and the same holds for all s >= 0 if
///
///     d - l - r_k a - a^2 / (2 R) - s (r_k + a / R) + s^2 / 2 (1 / l - 1 / R) > 0.
///
/// What is beyond a corner counts for both sides that meet there: it is beyond the line at right angles to the mean of
/// their normals, from which the place is (e_k + e_j) / 2 away at least.

#include "contact/region.h"
#include "contact/triangles.h"

namespace mpm::contact
{
/// Finds the rises around the triangles in a region, unless they are known.
/// @param within  distance from a triangle up to which the surface is looked at [m]
void find_rises(const Region<3>& region, double within, Triangles& surface);

/// The nearest point on the triangles in some boxes, if one is nearer than a limit.
/// @param start  a triangle that may be near, negative if none is known; out: the nearest one that was seen
NearestOnTriangles nearest_from(const Triangles& surface, const Vector<3>& x, std::span<const Index> boxes,
                                double limit, Index& start);
} // namespace mpm::contact
