#pragma once
/// @file
/// Triangulated sheets over squares, for tests and measurements of contact.

#include "contact/triangles.h"

namespace mpm::contact
{
/// @param squares  over the width of the sheet, each of two triangles
/// @param first    x and y of its lower left corner [m]
/// @param side     of a square [m]
/// @param height   a callable (x, y) -> double [m]
template <class F>
Triangles sheet(int squares, double first, double side, F&& height)
{
  std::vector<Vector<3>> vertices;
  std::vector<std::array<Index, 3>> triangles;
  for (int j = 0; j <= squares; ++j)
    for (int i = 0; i <= squares; ++i)
    {
      const double x = first + side * i, y = first + side * j;
      vertices.push_back({x, y, height(x, y)});
    }
  for (Index j = 0; j < squares; ++j)
    for (Index i = 0; i < squares; ++i)
    {
      const Index a = j * (squares + 1) + i, c = a + squares + 2;
      triangles.push_back({a, a + 1, c});
      triangles.push_back({a, c, c - 1});
    }
  return make_triangles(std::move(vertices), std::move(triangles));
}
} // namespace mpm::contact
