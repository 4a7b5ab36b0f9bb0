#pragma once
/// @file
/// The triangles of a surface in a region.

#include "contact/region.h"
#include "contact/triangles.h"

namespace mpm::contact
{
/// Adds the numbers of some boxes that contain all triangles in a region.
void add_boxes(const Triangles& surface, const Region<3>& region, std::vector<Index>& boxes);

/// Upper bound of normal . y over the points y of the triangles in a region.
/// @param fine  size of boxes that are not looked into [m]
double highest(const Triangles& surface, const Region<3>& region, const Vector<3>& normal, double fine);

/// The box around a triangle.
Region<3> box_of(const Triangles& surface, Index t);

/// Whether the border of a surface may pass through a region.
bool has_border(const Triangles& surface, const Region<3>& region);

/// Calls f(number) for the boxes in a region, from the root on; it returns whether to look into the box.
template <class F>
void visit_boxes(const Triangles& surface, const Region<3>& region, F&& f)
{
  std::vector<Index> stack{0};
  while (!stack.empty())
  {
    const Index number = stack.back();
    stack.pop_back();
    const TriangleBox& box = surface.boxes[static_cast<std::size_t>(number)];
    if (!overlap(region, box) || !f(number) || box.count > 0)
      continue;
    stack.push_back(box.first);
    stack.push_back(number + 1);
  }
}
} // namespace mpm::contact
