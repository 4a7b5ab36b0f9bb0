#include "contact/clearance.h"

#include "contact/triangle_parts.h"
#include "contact/triangle_rises.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <type_traits>

namespace mpm::contact
{
namespace
{
constexpr double relative_keep = 0.25; ///< travel after which bounds are found again, over the reach of a cell
constexpr double relative_sight = 1.0; ///< of a cell, over its reach: all of the cell is in sight after such a travel
constexpr double relative_ceiling = 0.75; ///< likewise: the width of a particle, and some travel
constexpr double relative_touch = 0.25;   ///< likewise: the radius of a particle
constexpr double relative_rises = 1.5;    ///< likewise: twice the width of a particle, and half of it
constexpr double fine_boxes = 0.05;       ///< size of a surface's boxes that are as good as their triangles; likewise

template <int D>
double apart(const Vector<D>& a, const Vector<D>& b)
{
  double sum = 0;
  for (int i = 0; i < D; ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

/// From the centre of a cell to its farthest vertex [m].
template <int D>
double reach_of(const Mesh<D>& mesh, Index cell)
{
  double reach = 0;
  for (Index node : mesh.cells[cell])
    reach = std::max(reach, apart<D>(mesh.points[node], mesh.shapes[cell].centre));
  return reach;
}

/// The box around a cell, as it lies to the surface at its start.
template <int D>
Region<D> box_of(const Mesh<D>& mesh, Index cell, const RigidBody<D>& body)
{
  const auto& nodes = mesh.cells[static_cast<std::size_t>(cell)];
  const auto place = [&](Index node) { return as_at_start<D>(body, mesh.points[static_cast<std::size_t>(node)]); };
  Region<D> box{place(nodes[0]), place(nodes[0])};
  for (Index node : nodes)
    include<D>(place(node), box);
  return box;
}

/// The triangle nearest to the centre of a cell; -1 where points of the cell may be nearest to the border of the
/// surface: beyond it that goes on where it has no triangles, and nothing is known from the cell.
/// @param x  its centre, as it lies to the surface at its start
Index triangle_near(const Triangles& triangles, const Vector<3>& x, const Distance<3>& nearest, const Region<3>& own,
                    double reach)
{
  const double apart = std::abs(nearest.value) * (1 + 1e-9) + 1e-9 * reach;
  static constexpr Index root = 0;
  const NearestOnTriangles found = nearest_on(triangles, x, std::span(&root, 1), apart * apart);
  if (!(found.squared < apart * apart) || has_border(triangles, widened(own, apart + 2 * reach)))
    return -1;
  return found.triangle;
}

/// Bounds of the surface for a cell that is near to it.
/// @param x  centre of the cell, as it lies to the surface at its start
template <int D>
void look_around(const Mesh<D>& mesh, Index cell, const Vector<D>& x, const Distance<D>& nearest, Contact<D>& contact,
                 CellBound<D>& bound)
{
  const RigidBody<D>& body = contact.body;
  bound.sight = relative_sight * bound.reach;
  bound.ceiling = relative_ceiling * bound.reach;
  const Region<D> own = box_of(mesh, cell, body), seen = widened(own, bound.sight),
                  region = widened(own, bound.ceiling);
  bound.first = bound.last = contact.parts.size();
  if constexpr (D == 2)
  {
    if (const auto* line = std::get_if<Polyline>(&contact.surface))
      add_segments(*line, seen, contact.parts);
  }
  else if (auto* triangles = std::get_if<Triangles>(&contact.surface))
  {
    bound.start = triangle_near(*triangles, x, nearest, own, bound.reach);
    bound.blind = bound.start < 0;
    if (bound.blind)
      return;
    add_boxes(*triangles, seen, contact.parts);
    find_rises(widened(own, relative_touch * bound.reach), relative_rises * bound.reach, *triangles);
  }
  bound.last = contact.parts.size();
  // The cell may not be beyond the surface: its centre is outside and above all of the surface that is close, so that
  // no line from there to another point of the cell that is above it, too, passes through the surface.
  if (nearest.value <= 0)
    return;
  const auto height_of = [&]<class Shape>(const Shape& shape)
  {
    if constexpr (std::is_same_v<Shape, Polyline>)
      return highest(shape, region, nearest.normal);
    else if constexpr (std::is_same_v<Shape, Triangles>)
      return highest(shape, region, nearest.normal, fine_boxes * bound.reach);
    else // all of a convex body is below the plane at its nearest point
      return dot<D>(nearest.normal, x) - nearest.value;
  };
  const double height = std::visit(height_of, contact.surface);
  if (!(height < dot<D>(nearest.normal, x)))
    return;
  bound.normal = rotated<D>(body.rotation, nearest.normal);
  bound.height = height;
  for (int i = 0; i < D; ++i)
    bound.height += bound.normal[i] * (mesh.shapes[cell].centre[i]) - nearest.normal[i] * x[i];
}
} // namespace

template <int D>
void keep_clearance(const Mesh<D>& mesh, Contact<D>& contact)
{
  if (!contact.bounds.empty() && contact.travel <= contact.keeps_for)
    return;
  const RigidBody<D>& body = contact.body;
  const bool first = contact.bounds.empty();
  contact.bounds.resize(static_cast<std::size_t>(mesh.owned_cells));
  contact.parts.clear();
  double smallest = std::numeric_limits<double>::infinity(), farthest = 0;
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    CellBound<D>& bound = contact.bounds[static_cast<std::size_t>(c)];
    const Vector<D>& centre = mesh.shapes[c].centre;
    bound.reach = reach_of<D>(mesh, c);
    smallest = std::min(smallest, bound.reach);
    farthest = std::max(farthest, apart<D>(as_at_start<D>(body, centre), body.centre) + bound.reach);
  }
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    CellBound<D>& bound = contact.bounds[static_cast<std::size_t>(c)];
    bound = {bound.distance - contact.travel, bound.reach};
    if (!first && !may_be_near(bound, relative_keep * smallest))
      continue; // still far: the bound has become smaller by the surface's travel
    const Vector<D> x = as_at_start<D>(body, mesh.shapes[c].centre);
    const Distance<D> nearest = distance<D>(contact.surface, x);
    bound.distance = nearest.value;
    if (may_be_near(bound, relative_keep * smallest))
      look_around<D>(mesh, c, x, nearest, contact, bound);
  }
  contact.travel = 0;
  contact.keeps_for = relative_keep * smallest;
  contact.reach = std::min(rotation_reach<D>(contact.surface, body.centre), farthest);
}

template void keep_clearance<2>(const Mesh<2>&, Contact<2>&);
template void keep_clearance<3>(const Mesh<3>&, Contact<3>&);
} // namespace mpm::contact
