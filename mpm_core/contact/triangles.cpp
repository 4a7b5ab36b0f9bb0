#include "contact/triangles.h"

#include "contact/region.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace mpm::contact
{
namespace
{
constexpr Index most_in_leaf = 2;
constexpr Index most_in_order = 256; ///< triangles that are sorted to divide them

Vector<3> plus(const Vector<3>& a, const Vector<3>& b, double factor)
{
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

void find_vertex_normals(Triangles& surface)
{
  surface.vertex_normals.assign(surface.vertices.size(), {});
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
  {
    const Vector<3> normal = unit_normal(surface, static_cast<Index>(t));
    for (std::size_t k = 0; k < 3; ++k)
    {
      const auto corner = static_cast<std::size_t>(surface.triangles[t][k]);
      const Vector<3> e = difference<3>(surface.vertices[static_cast<std::size_t>(surface.triangles[t][(k + 1) % 3])],
                                        surface.vertices[corner]);
      const Vector<3> f = difference<3>(surface.vertices[static_cast<std::size_t>(surface.triangles[t][(k + 2) % 3])],
                                        surface.vertices[corner]);
      const double cosine = dot<3>(e, f) / (norm<3>(e) * norm<3>(f));
      surface.vertex_normals[corner] =
          plus(surface.vertex_normals[corner], normal, std::acos(std::clamp(cosine, -1.0, 1.0)));
    }
  }
}

void find_first_at_vertices(Triangles& surface)
{
  surface.first_at_vertex.assign(surface.vertices.size(), std::numeric_limits<Index>::max());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (Index vertex : surface.triangles[t])
    {
      Index& first = surface.first_at_vertex[static_cast<std::size_t>(vertex)];
      first = std::min(first, surface.given[t]);
    }
}

/// Triangles across each side, by sorting the sides.
void find_neighbours(Triangles& surface)
{
  struct Side
  {
    Index low, high, triangle, number;
  };
  std::vector<Side> sides;
  sides.reserve(3 * surface.triangles.size());
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k)
    {
      const Index a = surface.triangles[t][k], b = surface.triangles[t][(k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), static_cast<Index>(t), static_cast<Index>(k)});
    }
  std::ranges::sort(sides, {}, [](const Side& side) { return std::array{side.low, side.high}; });
  surface.neighbours.assign(surface.triangles.size(), {-1, -1, -1});
  surface.at_border.assign(surface.vertices.size(), 0);
  const auto entry = [&surface](const Side& side) -> Index&
  { return surface.neighbours[static_cast<std::size_t>(side.triangle)][static_cast<std::size_t>(side.number)]; };
  for (std::size_t s = 0; s < sides.size(); ++s)
    if (s + 1 < sides.size() && sides[s].low == sides[s + 1].low && sides[s].high == sides[s + 1].high)
    {
      entry(sides[s]) = sides[s + 1].triangle;
      entry(sides[s + 1]) = sides[s].triangle;
      ++s;
    }
    else
    {
      surface.at_border[static_cast<std::size_t>(sides[s].low)] = 1;
      surface.at_border[static_cast<std::size_t>(sides[s].high)] = 1;
    }
}

/// Children come after their box.
void find_boxes_at_border(Triangles& surface)
{
  surface.box_at_border.assign(surface.boxes.size(), 0);
  for (std::size_t number = surface.boxes.size(); number-- > 0;)
  {
    const TriangleBox& box = surface.boxes[number];
    unsigned char any = 0;
    for (Index t = box.first; t < box.first + box.count; ++t)
      for (Index corner : surface.triangles[static_cast<std::size_t>(t)])
        any |= surface.at_border[static_cast<std::size_t>(corner)];
    if (box.count == 0)
      any = surface.box_at_border[number + 1] | surface.box_at_border[static_cast<std::size_t>(box.first)];
    surface.box_at_border[number] = any;
  }
}

/// Divides triangles into two parts along an axis: halves of many, few where the gap in between is widest, so that the
/// two triangles of a square stay together.
/// @param place  of the centre of a triangle, by its number
/// @returns how many belong to the first part
template <class F>
Index divide(std::span<Index> triangles, F&& place)
{
  const auto count = static_cast<Index>(triangles.size());
  const auto before = [&](Index a, Index b) { return place(a) < place(b); };
  Index middle = count / 2;
  if (count > most_in_order)
  {
    std::nth_element(triangles.begin(), triangles.begin() + middle, triangles.end(), before);
    return middle;
  }
  std::sort(triangles.begin(), triangles.end(), before);
  double widest = 0;
  for (Index k = std::max(count / 3, 1); k <= count - std::max(count / 3, 1); ++k)
    if (const double gap = place(triangles[k]) - place(triangles[k - 1]); gap > widest * (1 + 1e-9))
    {
      widest = gap;
      middle = k;
    }
  return middle;
}

/// A box around triangles, with those of its parts behind it.
/// @param order  numbers of the triangles, put in the order of the leaves
void add_box(const Triangles& surface, const std::vector<Vector<3>>& centres, Index first, Index last,
             std::vector<Index>& order, std::vector<TriangleBox>& boxes)
{
  constexpr double infinite = std::numeric_limits<double>::infinity();
  TriangleBox box{{infinite, infinite, infinite}, {-infinite, -infinite, -infinite}, first, last - first};
  Region<3> of_centres{box.lower, box.upper};
  for (Index k = first; k < last; ++k)
  {
    const auto t = static_cast<std::size_t>(order[static_cast<std::size_t>(k)]);
    for (Index vertex : surface.triangles[t])
      include<3>(surface.vertices[static_cast<std::size_t>(vertex)], box);
    include<3>(centres[t], of_centres);
  }
  const std::size_t number = boxes.size();
  boxes.push_back(box);
  if (box.count <= most_in_leaf)
    return;
  const Vector<3> extent = difference<3>(of_centres.upper, of_centres.lower);
  const auto axis = static_cast<std::size_t>(std::ranges::max_element(extent) - extent.begin());
  const auto place = [&](Index t) { return centres[static_cast<std::size_t>(t)][axis]; };
  const Index middle = divide(std::span(order).subspan(first, box.count), place) + first;
  boxes[number].count = 0;
  add_box(surface, centres, first, middle, order, boxes);
  boxes[number].first = static_cast<Index>(boxes.size());
  add_box(surface, centres, middle, last, order, boxes);
}

/// Boxes that a search has still to look at, and their distances squared; the last one comes first.
struct NearBoxes
{
  // Each part has a third of the triangles at least, so that 64 levels suffice; the search begins with a few boxes.
  std::array<std::pair<double, Index>, 64 + 2 * most_start_boxes> boxes;
  std::size_t size = 0;

  void push(const std::pair<double, Index>& box) { boxes[size++] = box; }
  void nearest_last()
  {
    for (std::size_t k = 1; k < size; ++k) // a few
      for (std::size_t i = k; i > 0 && boxes[i - 1].first < boxes[i].first; --i)
        std::swap(boxes[i - 1], boxes[i]);
  }
  void order_last_two()
  {
    if (boxes[size - 2].first < boxes[size - 1].first)
      std::swap(boxes[size - 2], boxes[size - 1]);
  }
};

double squared_distance(const TriangleBox& box, const Vector<3>& x)
{
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i)
  {
    const double beyond = std::max(std::max(box.lower[i] - x[i], x[i] - box.upper[i]), 0.0);
    sum += beyond * beyond;
  }
  return sum;
}

/// The nearest point of a triangle, by the regions of Voronoi of its corners and sides (Ericson 2005, section 5.1.5).
NearestOnTriangles nearest_on_one(const Triangles& surface, Index t, const Vector<3>& x)
{
  const Vector<3>& a = corner_of(surface, t, 0);
  const Vector<3> ab = difference<3>(corner_of(surface, t, 1), a), ac = difference<3>(corner_of(surface, t, 2), a);
  const Vector<3> ap = difference<3>(x, a), bp = difference<3>(ap, ab), cp = difference<3>(ap, ac);
  const auto at = [&](int feature, double v, double w)
  {
    const Vector<3> offset = plus(plus(ap, ab, -v), ac, -w);
    return NearestOnTriangles{t, feature, offset, dot<3>(offset, offset), {w, 1 - v - w, v}};
  };
  const double d1 = dot<3>(ab, ap), d2 = dot<3>(ac, ap), d3 = dot<3>(ab, bp), d4 = dot<3>(ac, bp);
  const double d5 = dot<3>(ab, cp), d6 = dot<3>(ac, cp);
  if (d1 <= 0 && d2 <= 0)
    return at(4, 0, 0);
  if (d3 >= 0 && d4 <= d3)
    return at(5, 1, 0);
  if (d6 >= 0 && d5 <= d6)
    return at(6, 0, 1);
  const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0)
    return at(1, d1 / (d1 - d3), 0);
  if (vb <= 0 && d2 >= 0 && d6 <= 0)
    return at(3, 0, d2 / (d2 - d6));
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
  {
    const double w = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    return at(2, 1 - w, w);
  }
  const double sum = va + vb + vc;
  return at(0, vb / sum, vc / sum);
}
} // namespace

Vector<3> unit_normal(const Triangles& surface, Index t)
{
  const Vector<3>& origin = corner_of(surface, t, 0);
  const Vector<3> e = difference<3>(corner_of(surface, t, 1), origin),
                  f = difference<3>(corner_of(surface, t, 2), origin);
  const Vector<3> n = cross(e, f);
  const double length = norm<3>(n);
  return {n[0] / length, n[1] / length, n[2] / length};
}

Triangles make_triangles(std::vector<Vector<3>> vertices, std::vector<std::array<Index, 3>> triangles)
{
  Triangles surface{std::move(vertices), std::move(triangles), {}, {}, {}, {}, {}, {}, {}, {}};
  std::vector<Vector<3>> centres;
  for (const auto& [a, b, c] : surface.triangles)
  {
    Vector<3> sum{};
    for (Index vertex : {a, b, c})
      sum = plus(sum, surface.vertices[static_cast<std::size_t>(vertex)], 1.0 / 3);
    centres.push_back(sum);
  }
  std::vector<Index> order(surface.triangles.size());
  std::iota(order.begin(), order.end(), 0);
  add_box(surface, centres, 0, static_cast<Index>(order.size()), order, surface.boxes);
  // Triangles in the order of the leaves: near ones are near in memory.
  std::vector<std::array<Index, 3>> sorted;
  for (Index t : order)
    sorted.push_back(surface.triangles[static_cast<std::size_t>(t)]);
  surface.triangles = std::move(sorted);
  surface.given = std::move(order);
  find_neighbours(surface);
  find_vertex_normals(surface);
  find_first_at_vertices(surface);
  find_boxes_at_border(surface);
  return surface;
}

NearestOnTriangles nearest_on(const Triangles& surface, const Vector<3>& x)
{
  static constexpr Index root = 0;
  return nearest_on(surface, x, std::span(&root, 1), std::numeric_limits<double>::infinity());
}

NearestOnTriangles nearest_on(const Triangles& surface, const Vector<3>& x, std::span<const Index> boxes,
                              double squared)
{
  NearestOnTriangles best;
  best.squared = squared;
  NearBoxes near;
  const auto look_at = [&](Index number)
  {
    const double apart = squared_distance(surface.boxes[static_cast<std::size_t>(number)], x);
    if (apart < best.squared)
      near.push({apart, number});
  };
  for (Index number : boxes)
    look_at(number);
  near.nearest_last();
  while (near.size > 0)
  {
    const auto [apart, number] = near.boxes[--near.size];
    if (apart >= best.squared)
      continue;
    const TriangleBox& box = surface.boxes[static_cast<std::size_t>(number)];
    for (Index t = box.first; t < box.first + box.count; ++t)
      if (const NearestOnTriangles found = nearest_on_one(surface, t, x); found.squared < best.squared)
        best = found;
    if (box.count > 0)
      continue;
    const std::size_t before = near.size;
    look_at(number + 1);
    look_at(box.first);
    if (near.size == before + 2)
      near.order_last_two();
  }
  return best;
}

NearestOnTriangles walk_on(const Triangles& surface, const Vector<3>& x, Index from)
{
  constexpr int most_steps = 8;
  NearestOnTriangles best = nearest_on_one(surface, from, x);
  Index before = -1;
  for (int step = 0; step < most_steps && best.feature != 0; ++step)
  {
    const auto& neighbours = surface.neighbours[static_cast<std::size_t>(best.triangle)];
    const auto side = static_cast<std::size_t>(best.feature - 1) % 3; // of a corner, the one that begins there
    Index next = neighbours[side];
    if (best.feature > 3 && (next < 0 || next == before))
      next = neighbours[(side + 2) % 3];
    if (next < 0 || next == before)
      break;
    before = best.triangle;
    if (const NearestOnTriangles found = nearest_on_one(surface, next, x); found.squared <= best.squared)
      best = found;
    else
      break;
  }
  return best;
}

Vector<3> outward_at(const Triangles& surface, const NearestOnTriangles& nearest)
{
  const auto t = static_cast<std::size_t>(nearest.triangle);
  Vector<3> normal = unit_normal(surface, nearest.triangle);
  if (nearest.feature >= 4)
    normal = surface.vertex_normals[static_cast<std::size_t>(
        surface.triangles[t][static_cast<std::size_t>(nearest.feature - 4)])];
  else if (nearest.feature > 0)
    if (const Index other = surface.neighbours[t][static_cast<std::size_t>(nearest.feature - 1)]; other >= 0)
      normal = plus(normal, unit_normal(surface, other), 1);
  const double length = norm<3>(normal);
  return {normal[0] / length, normal[1] / length, normal[2] / length};
}

Index part_at(const Triangles& surface, const NearestOnTriangles& nearest)
{
  const auto t = static_cast<std::size_t>(nearest.triangle);
  if (nearest.feature == 0)
    return surface.given[t];
  if (nearest.feature >= 4)
    return surface
        .first_at_vertex[static_cast<std::size_t>(surface.triangles[t][static_cast<std::size_t>(nearest.feature - 4)])];
  const Index other = surface.neighbours[t][static_cast<std::size_t>(nearest.feature - 1)];
  return other < 0 ? surface.given[t] : std::min(surface.given[t], surface.given[static_cast<std::size_t>(other)]);
}

bool is_at_border(const Triangles& surface, const NearestOnTriangles& nearest)
{
  const auto t = static_cast<std::size_t>(nearest.triangle);
  if (nearest.feature >= 4)
    return surface.at_border[static_cast<std::size_t>(
               surface.triangles[t][static_cast<std::size_t>(nearest.feature - 4)])] != 0;
  return nearest.feature > 0 && surface.neighbours[t][static_cast<std::size_t>(nearest.feature - 1)] < 0;
}
} // namespace mpm::contact
