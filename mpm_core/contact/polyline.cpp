#include "contact/polyline.h"

#include <cmath>

namespace mpm::contact
{
namespace
{
constexpr double endless = std::numeric_limits<double>::infinity();

std::size_t segments_of(const Polyline& line) { return line.points.size() - (line.closed ? 0 : 1); }

/// To the left of a segment, of length 1.
Vector<2> left_normal(const Polyline& line, std::size_t k)
{
  const Vector<2> e = difference<2>(line.points[(k + 1) % line.points.size()], line.points[k]);
  const double length = norm<2>(e);
  return {-e[1] / length, e[0] / length};
}

/// Whether a segment goes on straight beyond one of its ends.
bool is_endless(const Polyline& line, std::size_t k) { return !line.closed && (k == 0 || k + 1 == segments_of(line)); }

void look_at(const Polyline& line, std::size_t k, const Vector<2>& x, NearestOnLine& best)
{
  const Vector<2>& from = line.points[k];
  const Vector<2> e = difference<2>(line.points[(k + 1) % line.points.size()], from), r = difference<2>(x, from);
  const double low = !line.closed && k == 0 ? -endless : 0;
  const double high = !line.closed && k + 1 == segments_of(line) ? endless : 1;
  const double along = std::clamp(dot<2>(r, e) / dot<2>(e, e), low, high);
  const Vector<2> offset{r[0] - along * e[0], r[1] - along * e[1]};
  if (const double squared = dot<2>(offset, offset); squared < best.squared)
    best = {k, along, squared, offset};
}

/// Whether a point is nearest to the corner at which its segment begins.
bool is_at_start(const Polyline& line, const NearestOnLine& at)
{
  return at.along == 0 && (line.closed || at.segment > 0);
}

/// The box around a segment, without what is beyond the ends of a line.
Region<2> box_of(const Polyline& line, std::size_t k)
{
  const Vector<2>&a = line.points[k], &b = line.points[(k + 1) % line.points.size()];
  return {{std::min(a[0], b[0]), std::min(a[1], b[1])}, {std::max(a[0], b[0]), std::max(a[1], b[1])}};
}
} // namespace

NearestOnLine nearest_on(const Polyline& line, const Vector<2>& x)
{
  NearestOnLine best;
  for (std::size_t k = 0; k < segments_of(line); ++k)
    look_at(line, k, x, best);
  return best;
}

NearestOnLine nearest_on(const Polyline& line, const Vector<2>& x, std::span<const Index> segments, double squared)
{
  NearestOnLine best;
  best.squared = squared;
  for (Index k : segments)
    look_at(line, static_cast<std::size_t>(k), x, best);
  return best;
}

// At a corner it is the sum of the normals of both segments, whose sign is right on either side however sharp the
// corner (Baerentzen & Aanaes 2005).
Vector<2> outward_at(const Polyline& line, const NearestOnLine& at)
{
  const std::size_t n = segments_of(line);
  const Vector<2> normal = left_normal(line, at.segment);
  const bool first = is_at_start(line, at);
  const bool last = at.along == 1 && (line.closed || at.segment + 1 < n);
  if (!first && !last)
    return normal;
  const Vector<2> other = left_normal(line, (at.segment + (first ? n - 1 : 1)) % n);
  return {normal[0] + other[0], normal[1] + other[1]};
}

Index part_at(const Polyline& line, const NearestOnLine& at)
{
  const std::size_t n = segments_of(line);
  return static_cast<Index>(is_at_start(line, at) ? (at.segment + n - 1) % n : at.segment);
}

void add_segments(const Polyline& line, const Region<2>& region, std::vector<Index>& segments)
{
  for (std::size_t k = 0; k < segments_of(line); ++k)
    if (is_endless(line, k) || overlap(region, box_of(line, k)))
      segments.push_back(static_cast<Index>(k));
}

double highest(const Polyline& line, const Region<2>& region, const Vector<2>& normal)
{
  double height = -endless;
  for (std::size_t k = 0; k < segments_of(line); ++k)
  {
    const bool whole = is_endless(line, k);
    if (!whole && !overlap(region, box_of(line, k)))
      continue;
    const Region<2> box = whole ? region : common(region, box_of(line, k));
    height = std::max(height, highest_on_plane<2>(box, normal, left_normal(line, k), line.points[k]));
  }
  return height;
}
} // namespace mpm::contact
