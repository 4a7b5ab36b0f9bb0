#pragma once
/// @file
/// Rigid surfaces as plain values, with their signed distance and their normal.

#include "contact/polyline.h"
#include "contact/triangles.h"

#include <optional>
#include <variant>

namespace mpm::contact
{
/// A half space; the normal, of length 1, points out of it towards the soil.
template <int D>
struct Plane
{
  Vector<D> point, normal;
};

/// A solid disc (the section of a cylinder) in two dimensions, a solid sphere in three.
template <int D>
struct Ball
{
  Vector<D> centre;
  double radius;
};

/// A solid box along the axes.
template <int D>
struct Box
{
  Vector<D> lower, upper;
};

/// A solid of revolution: the closed section, which mirrors itself in the axis, in coordinates (r, z) from a point on
/// it.
struct Revolved
{
  Vector<3> point, axis; ///< z is along the axis, of length 1
  Polyline section;
};

template <int D>
using Surface = std::conditional_t<D == 2, std::variant<Plane<2>, Ball<2>, Box<2>, Polyline>,
                                   std::variant<Plane<3>, Ball<3>, Box<3>, Triangles, Revolved>>;

/// From a rigid body to a point: positive outside of the body; the normal has length 1 and points out of it.
template <int D>
struct Distance
{
  double value; ///< [m]
  Vector<D> normal;
  Index part = 0; ///< the segment of a polyline, or the triangle as it was given, on which the nearest point is
};

template <int D>
Distance<D> distance(const Surface<D>& surface, const Vector<D>& x);

/// Distance of a point if it is at most `limit`, else nothing: by a search of some parts, which are segments of a
/// polyline or boxes of triangles. Surfaces without parts always give it.
/// @param parts  contain all of the surface that is so near
/// @param start  a triangle that may be near, negative if none is known; out: the nearest one that was seen
template <int D>
std::optional<Distance<D>> distance_within(const Surface<D>& surface, const Vector<D>& x, std::span<const Index> parts,
                                           double limit, Index& start);

/// How far the surface moves at most when it rotates by one radian about a point [m]; infinite where it is endless.
template <int D>
double rotation_reach(const Surface<D>& surface, const Vector<D>& centre);
} // namespace mpm::contact
