#include "contact/triangle_parts.h"

#include <limits>

namespace mpm::contact
{
namespace
{
double size_of(const TriangleBox& box) { return norm<3>(difference<3>(box.upper, box.lower)); }
} // namespace

Region<3> box_of(const Triangles& surface, Index t)
{
  Region<3> box{corner_of(surface, t, 0), corner_of(surface, t, 0)};
  for (std::size_t k = 1; k < 3; ++k)
    include<3>(corner_of(surface, t, k), box);
  return box;
}

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
          const double top =
              highest_on_plane<3>(common(region, around), normal, unit_normal(surface, t), corner_of(surface, t, 0));
          height = std::max(height, top);
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
