#include "contact/triangle_rises.h"

#include "contact/triangle_parts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::contact
{
namespace
{
constexpr double touching = 1e-12;  ///< height and distance of what is on a side of a triangle, over its size
constexpr double margin = 1e-3;     ///< of the rises, relative
constexpr double least_rise = 1e-4; ///< so that what is as near as T, but for round-off, is not taken for farther
constexpr double far_box = 2;       ///< distance of a box that is as good as its triangles, over its size
constexpr double enough = 0.9;      ///< of the distance wanted, so that cells of the same size do not ask again

/// A line in the plane of a triangle, which is on its other side: a point is at least normal . x - offset away.
struct Line
{
  Vector<3> normal;
  double offset;
};

/// A triangle as others are seen from it.
struct Frame
{
  Vector<3> normal;
  double offset; ///< of its plane
  std::array<Line, 6> lines;
  double height; ///< the smallest [m]
};

Line line_through(const Vector<3>& point, Vector<3> direction)
{
  const double length = norm<3>(direction);
  for (double& component : direction)
    component /= length;
  return {direction, dot<3>(direction, point)};
}

Frame frame_of(const Triangles& surface, Index t)
{
  Frame frame{unit_normal(surface, t), 0, {}, std::numeric_limits<double>::infinity()};
  const auto corner = [&](std::size_t k) -> const Vector<3>& { return corner_of(surface, t, k % 3); };
  frame.offset = dot<3>(frame.normal, corner(0));
  for (std::size_t k = 0; k < 3; ++k)
  {
    frame.lines[k] = line_through(corner(k), cross(difference<3>(corner(k + 1), corner(k)), frame.normal));
    frame.height = std::min(frame.height, frame.lines[k].offset - dot<3>(frame.lines[k].normal, corner(k + 2)));
  }
  for (std::size_t k = 0; k < 3; ++k) // between the normals of the sides that meet at a corner
  {
    Vector<3> between = frame.lines[k].normal;
    for (std::size_t i = 0; i < 3; ++i)
      between[i] += frame.lines[(k + 2) % 3].normal[i];
    frame.lines[k + 3] = line_through(corner(k), between);
  }
  return frame;
}

/// What is found to rise beyond the lines of a triangle.
using Rises = std::array<double, 6>;

/// Counts a triangle for the line that it rises least from, of those that it is all beyond: by the largest rise at its
/// corners, for u^2 / (2 R) is at least u / (2 R) times the smallest u.
void count_triangle(const Triangles& surface, Index t, const Frame& frame, double within, Rises& rises)
{
  constexpr double unknown = std::numeric_limits<double>::infinity();
  const double tolerance = touching * frame.height;
  std::array<double, 3> height;
  for (std::size_t k = 0; k < 3; ++k)
    height[k] = dot<3>(frame.normal, corner_of(surface, t, k)) - frame.offset;
  if (std::ranges::max(height) <= tolerance)
    return;
  std::size_t line = 0;
  double rise = unknown;
  for (std::size_t n = 0; n < frame.lines.size(); ++n)
  {
    double along = 0, nearest = unknown;
    for (std::size_t k = 0; k < 3; ++k)
    {
      const double apart = dot<3>(frame.lines[n].normal, corner_of(surface, t, k)) - frame.lines[n].offset;
      nearest = std::min(nearest, std::max(apart, 0.0));
      if (apart < -tolerance || (height[k] > tolerance && apart <= tolerance))
        along = unknown;
      else if (height[k] > tolerance)
        along = std::max(along, height[k] / apart);
    }
    if (along - nearest / (2 * within) < rise)
    {
      rise = along - nearest / (2 * within);
      line = n;
    }
  }
  rises[line] = std::max(rises[line], rise);
}

/// Counts a box of triangles as a whole if it is far or rises no more than others do.
/// @returns whether that was so
bool count_box(const Region<3>& box, const Frame& frame, double within, Rises& rises)
{
  const double top = highest_in<3>(box, frame.normal) - frame.offset;
  if (top <= 0)
    return true;
  const double far = far_box * norm<3>(difference<3>(box.upper, box.lower));
  for (std::size_t n = 0; n < frame.lines.size(); ++n)
  {
    const auto& [normal, offset] = frame.lines[n];
    const double apart = -highest_in<3>(box, {-normal[0], -normal[1], -normal[2]}) - offset;
    if (apart <= 0 || (apart <= far && top > (rises[n] + apart / (2 * within)) * apart))
      continue;
    rises[n] = std::max(rises[n], top / apart - apart / (2 * within));
    return true;
  }
  return false;
}

TriangleRise rise_around(const Triangles& surface, Index t, double within)
{
  const Frame frame = frame_of(surface, t);
  const Region<3> region = widened(box_of(surface, t), within);
  Rises rises{};
  const auto look_at = [&](Index number)
  {
    const TriangleBox& box = surface.boxes[static_cast<std::size_t>(number)];
    if (count_box(common(region, box), frame, within, rises))
      return false;
    for (Index other = box.first; other < box.first + box.count; ++other)
      if (other != t)
        count_triangle(surface, other, frame, within, rises);
    return true;
  };
  visit_boxes(surface, region, look_at);
  TriangleRise found{{}, {}, static_cast<float>(within)};
  for (std::size_t k = 0; k < 3; ++k)
  {
    const double rise = std::max({rises[k], rises[k + 3], rises[(k + 1) % 3 + 3]}); // of the side and of its corners
    const Line& side = frame.lines[k];
    const double height = side.offset - dot<3>(side.normal, corner_of(surface, t, (k + 2) % 3));
    found.rise[k] = static_cast<float>((1 + margin) * rise + least_rise);
    found.height[k] = static_cast<float>((1 - margin) * height);
  }
  return found;
}
} // namespace

void find_rises(const Region<3>& region, double within, Triangles& surface)
{
  surface.rises.resize(surface.triangles.size());
  const auto look_at = [&](Index number)
  {
    const TriangleBox& box = surface.boxes[static_cast<std::size_t>(number)];
    for (Index t = box.first; t < box.first + box.count; ++t)
      if (TriangleRise& known = surface.rises[static_cast<std::size_t>(t)]; known.within < enough * within)
        known = rise_around(surface, t, within);
    return true;
  };
  visit_boxes(surface, region, look_at);
}

namespace
{
/// Whether curvature s^2 / 2 - falls s + lowest is positive for all s >= 0.
bool stays_above(double lowest, double falls, double curvature)
{
  return lowest > 0 && (falls <= 0 || falls * falls < 2 * lowest * curvature);
}

/// Whether no other triangle is as near to a point as the one found, or nearer than a limit. False where it is not
/// known.
bool is_clear(const Triangles& surface, const NearestOnTriangles& found, double limit)
{
  if (surface.rises.empty())
    return false;
  const auto& [rise, height, within] = surface.rises[static_cast<std::size_t>(found.triangle)];
  const double apart = std::sqrt(found.squared), ball = std::min(apart, limit);
  if (!(apart + ball < within) || (found.feature != 0 && apart <= limit))
    return false;
  const auto corner = [&](std::size_t k) -> const Vector<3>& { return corner_of(surface, found.triangle, k); };
  const Vector<3> normal = cross(difference<3>(corner(1), corner(0)), difference<3>(corner(2), corner(0)));
  const double up = dot<3>(normal, found.offset), curvature = 1 / ball - 1 / within;
  if (!(up > 0))
    return false;
  if (found.feature == 0)
  {
    bool clear = true;
    for (std::size_t k = 0; k < 3; ++k)
    {
      const double inside = height[k] * found.inside[k], slope = inside / ball;
      clear = clear && stays_above(apart - ball + 0.5 * inside * slope, rise[k] - slope, curvature);
    }
    return clear;
  }
  const double squared_height = up * up / dot<3>(normal, normal);
  const double beside = std::sqrt(std::max(found.squared - squared_height, 0.0)), most = std::ranges::max(rise);
  return stays_above(std::sqrt(squared_height) - ball - beside * (most + 0.5 * beside / within), most + beside / within,
                     curvature);
}
} // namespace

NearestOnTriangles nearest_from(const Triangles& surface, const Vector<3>& x, std::span<const Index> boxes,
                                double limit, Index& start)
{
  constexpr double round_off = 1e-9; // relative
  double squared = limit * limit;
  if (start >= 0)
  {
    const NearestOnTriangles near = walk_on(surface, x, start);
    start = near.triangle;
    if (is_clear(surface, near, limit))
      return near;
    squared = std::min(squared, (1 + round_off) * near.squared);
  }
  const NearestOnTriangles found = nearest_on(surface, x, boxes, squared);
  if (found.squared < squared)
    start = found.triangle;
  return found;
}
} // namespace mpm::contact
