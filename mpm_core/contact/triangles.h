#pragma once
/// @file
/// Triangulated surfaces, with a tree of boxes that finds the triangle nearest to a point in O(log n).

#include "base/tensor.h"

#include <limits>
#include <span>
#include <vector>

namespace mpm::contact
{
/// A box around some triangles: of a leaf those from `first` on, else those of its two children.
struct TriangleBox
{
  Vector<3> lower, upper;
  Index first; ///< triangle of a leaf; else number of the second child, the first one being the next box
  Index count; ///< of triangles; 0 where it has children
};

/// How the surface around a triangle rises over its plane; see triangle_rises.h.
struct TriangleRise
{
  std::array<float, 3> rise{};   ///< beyond the side from vertex k to k + 1, over the distance from it
  std::array<float, 3> height{}; ///< of the triangle over this side [m]
  float within = -1;             ///< distance up to which this is so; negative while unknown [m]
};

/// Triangles whose vertices run counterclockwise as seen from the soil. A closed surface bounds a body or a cavity; an
/// open one, with one border, goes on straight beyond it.
struct Triangles
{
  std::vector<Vector<3>> vertices; ///< [m]
  std::vector<std::array<Index, 3>> triangles;
  std::vector<Index> given;                     ///< number of each triangle in the order in which they were given
  std::vector<std::array<Index, 3>> neighbours; ///< across the side from vertex k to k + 1; -1 at a border
  std::vector<Index> first_at_vertex;           ///< the least number, as given, of the triangles around a vertex
  std::vector<Vector<3>> vertex_normals;        ///< normals of the triangles around it, weighted with their angles
  std::vector<unsigned char> at_border;         ///< per vertex
  std::vector<TriangleBox> boxes;               ///< the root first
  std::vector<unsigned char> box_at_border;     ///< per box, whether any vertex in it is
  std::vector<TriangleRise> rises;              ///< per triangle; empty before any is known
};

/// @pre each side belongs to one triangle, or to two that pass it in opposite directions; no triangle without area
Triangles make_triangles(std::vector<Vector<3>> vertices, std::vector<std::array<Index, 3>> triangles);

/// Corner 0, 1 or 2 of a triangle.
inline const Vector<3>& corner_of(const Triangles& surface, Index t, std::size_t k)
{
  return surface.vertices[static_cast<std::size_t>(surface.triangles[static_cast<std::size_t>(t)][k])];
}

/// Normal of a triangle, of length 1, on the side of the soil.
Vector<3> unit_normal(const Triangles& surface, Index t);

/// The point of a surface that is nearest to another one.
struct NearestOnTriangles
{
  Index triangle = 0;
  int feature = 0;    ///< 0 inside of it, 1 to 3 on the side from vertex k - 1, 4 to 6 at vertex k - 4
  Vector<3> offset{}; ///< from there to the other point [m]
  double squared = std::numeric_limits<double>::infinity(); ///< its length squared [m2]
  std::array<double, 3> inside{}; ///< of the side from vertex k to k + 1: the distance from it over the height
};

NearestOnTriangles nearest_on(const Triangles& surface, const Vector<3>& x);

/// Boxes from which a search may begin, at most.
inline constexpr std::size_t most_start_boxes = 8;

/// The nearest point on the triangles in some boxes, at most `most_start_boxes`; if one is nearer than a limit.
/// @param squared  the limit, or what is returned without any [m2]
NearestOnTriangles nearest_on(const Triangles& surface, const Vector<3>& x, std::span<const Index> boxes,
                              double squared);

/// The point nearest to another one, on a triangle near it: by steps from one on to neighbours that are nearer.
NearestOnTriangles walk_on(const Triangles& surface, const Vector<3>& x, Index from);

/// The outward direction where a point is nearest, of length 1: its sign is right also where it is nearest to a side or
/// to a vertex (Baerentzen & Aanaes 2005).
Vector<3> outward_at(const Triangles& surface, const NearestOnTriangles& nearest);

/// Number, as given, of the triangle on which the nearest point is; the least one where that is on a side or a vertex,
/// so that it does not depend on the search.
Index part_at(const Triangles& surface, const NearestOnTriangles& nearest);

/// Whether the nearest point is on a border.
bool is_at_border(const Triangles& surface, const NearestOnTriangles& nearest);
} // namespace mpm::contact
