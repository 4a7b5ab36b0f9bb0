/// Where the surface around a triangle is known not to rise much, the triangle that a walk finds is the nearest one.

#include "contact/triangle_rises.h"

#include "sheets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

using namespace mpm::contact;

namespace
{
constexpr Index squares = 14; ///< over the unit square

/// A sheet over the unit square.
template <class F>
Triangles unit_sheet(F&& height)
{
  return sheet(squares, 0, 1.0 / squares, height);
}

/// Points around a sheet: a walk finds the nearest triangle, or says nothing.
/// @returns the part of the points near the sheet and outside for which it is found
double found_without_search(Triangles surface)
{
  find_rises({{-1, -1, -1}, {2, 2, 2}}, 0.15, surface);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> along(0.1, 0.9), up(0, 0.06);
  constexpr double limit = 0.04;
  int near = 0, found = 0;
  for (int k = 0; k < 20000; ++k)
  {
    Vector<3> x{along(random), along(random), 1};
    const NearestOnTriangles below = nearest_on(surface, {x[0], x[1], 0.5}); // some triangle that is not far
    x[2] = surface.vertices[static_cast<std::size_t>(surface.triangles[below.triangle][0])][2] + up(random);
    const NearestOnTriangles exact = nearest_on(surface, x);
    Index start = below.triangle;
    const NearestOnTriangles walked = nearest_from(surface, x, {}, limit, start);
    near += exact.squared < limit * limit && dot<3>(outward_at(surface, exact), exact.offset) > 0;
    if (walked.offset == Vector<3>{} || walked.squared >= limit * limit)
      continue; // not known, and no boxes to search; or farther away
    ++found;
    EXPECT_EQ(walked.triangle, exact.triangle);
    EXPECT_EQ(walked.offset, exact.offset);
  }
  return double(found) / near;
}
} // namespace

TEST(TriangleRises, LetNoSearchBeNeededOverHills)
{
  EXPECT_GT(
      found_without_search(unit_sheet([](double x, double y) { return 0.04 * std::sin(8 * x) * std::cos(9 * y); })),
      0.6);
}

TEST(TriangleRises, AreRightInRoughGround)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> height(-0.05, 0.05);
  EXPECT_GT(found_without_search(unit_sheet([&](double, double) { return height(random); })), 0.05);
}

TEST(TriangleRises, OfTheInsideOfABowlAndOfACap)
{
  const auto bowl = [](double x, double y) { return 1.5 * ((x - 0.5) * (x - 0.5) + (y - 0.5) * (y - 0.5)); };
  EXPECT_GT(found_without_search(unit_sheet(bowl)), 0.4);
  EXPECT_GT(found_without_search(unit_sheet([&](double x, double y) { return -bowl(x, y); })), 0.4);
}
