#include "contact/triangle_parts.h"

#include <limits>

namespace mpm::contact
{
namespace
{
double size_of(const TriangleBox& box) { return norm<3>(difference<3>(box.upper, box.lower)); }

Region<3> box_of(const Triangles& surface, Index t)
{
  const auto& corners = surface.triangles[static_cast<std::size_t>(t)];
  const auto vertex = [&](Index corner) -> const Vector<3>&
  { return surface.vertices[static_cast<std::size_t>(corner)]; };
  Region<3> box{vertex(corners[0]), vertex(corners[0])};
  for (Index corner : corners)
    include<3>(vertex(corner), box);
  return box;
}

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
} // namespace

void add_boxes(const Triangles& surface, const Region<3>& region, std::vector<Index>& boxes)
{
  std::vector<Index> found{0}, inner;
  bool grows = true;
  while (grows && 2 * found.size() <= most_start_boxes)
  {
    grows = false;
    inner.clear();
    for (Index number : found)
    {
      const TriangleBox& box = surface.boxes[static_cast<std::size_t>(number)];
      if (!overlap(region, box))
        continue;
      grows |= box.count == 0;
      inner.push_back(box.count > 0 ? number : number + 1);
      if (box.count == 0)
        inner.push_back(box.first);
    }
    found.swap(inner);
  }
  for (Index number : found)
    if (overlap(region, surface.boxes[static_cast<std::size_t>(number)]))
      boxes.push_back(number);
}

double highest(const Triangles& surface, const Region<3>& region, const Vector<3>& normal, double fine)
{
  double height = -std::numeric_limits<double>::infinity();
  const auto look_at = [&](Index number)
  {
    const TriangleBox& box = surface.boxes[static_cast<std::size_t>(number)];
    const double bound = highest_in<3>(common(region, box), normal);
    if (bound <= height)
      return false;
    if (size_of(box) <= fine)
      height = bound;
    else
      for (Index t = box.first; t < box.first + box.count; ++t)
        if (const Region<3> around = box_of(surface, t); overlap(region, around))
        {
          const Vector<3>& corner =
              surface.vertices[static_cast<std::size_t>(surface.triangles[static_cast<std::size_t>(t)][0])];
          height =
              std::max(height, highest_on_plane<3>(common(region, around), normal, unit_normal(surface, t), corner));
        }
    return size_of(box) > fine;
  };
  visit_boxes(surface, region, look_at);
  return height;
}

bool has_border(const Triangles& surface, const Region<3>& region)
{
  bool found = false;
  visit_boxes(surface, region,
              [&](Index number)
              {
                const bool here = surface.box_at_border[static_cast<std::size_t>(number)] != 0;
                found |= here && surface.boxes[static_cast<std::size_t>(number)].count > 0;
                return here && !found;
              });
  return found;
}
} // namespace mpm::contact
