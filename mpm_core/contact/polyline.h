#pragma once
/// @file
/// Lines of segments in two dimensions.

#include "contact/region.h"

#include <limits>
#include <span>
#include <vector>

namespace mpm::contact
{
/// Segments from point to point with the soil on their left. An open line goes on straight beyond its ends; a closed
/// one returns from its last point to its first.
struct Polyline
{
  std::vector<Vector<2>> points;
  bool closed;
};

/// The nearest point on a line: its segment, and where along it, from 0 to 1 but beyond the ends of an open line.
struct NearestOnLine
{
  std::size_t segment = 0;
  double along = 0;
  double squared = std::numeric_limits<double>::infinity(); ///< distance [m2]
  Vector<2> offset{};                                       ///< from there to the point [m]
};

NearestOnLine nearest_on(const Polyline& line, const Vector<2>& x);

/// The nearest point on some of the segments, if one is nearer than a limit.
/// @param squared  the limit, or what is returned without any [m2]
NearestOnLine nearest_on(const Polyline& line, const Vector<2>& x, std::span<const Index> segments, double squared);

/// The outward direction where a point is nearest, of any length: its sign is right also at corners.
Vector<2> outward_at(const Polyline& line, const NearestOnLine& at);

/// The segment on which the nearest point is; of the two at a corner, the one that ends there.
Index part_at(const Polyline& line, const NearestOnLine& at);

/// Adds the numbers of the segments that may be in a region.
void add_segments(const Polyline& line, const Region<2>& region, std::vector<Index>& segments);

/// Upper bound of normal . y over the points y of the line in a region.
double highest(const Polyline& line, const Region<2>& region, const Vector<2>& normal);
} // namespace mpm::contact
