#pragma once
/// @file
/// Boxes along the axes, in which parts of surfaces are looked for.

#include "base/tensor.h"

#include <algorithm>

namespace mpm::contact
{
template <int D>
struct Region
{
  Vector<D> lower, upper;
};

/// Lets a box grow to contain a point.
template <int D, class B>
void include(const Vector<D>& x, B& box)
{
  for (int i = 0; i < D; ++i)
  {
    box.lower[i] = std::min(box.lower[i], x[i]);
    box.upper[i] = std::max(box.upper[i], x[i]);
  }
}

template <int D>
Region<D> widened(Region<D> region, double by)
{
  for (int i = 0; i < D; ++i)
  {
    region.lower[i] -= by;
    region.upper[i] += by;
  }
  return region;
}

template <int D, class B>
bool overlap(const Region<D>& region, const B& box)
{
  for (int i = 0; i < D; ++i)
    if (box.lower[i] > region.upper[i] || box.upper[i] < region.lower[i])
      return false;
  return true;
}

/// The part of a box in a region.
template <int D, class B>
Region<D> common(const Region<D>& region, const B& box)
{
  Region<D> both;
  for (int i = 0; i < D; ++i)
  {
    both.lower[i] = std::max(region.lower[i], box.lower[i]);
    both.upper[i] = std::min(region.upper[i], box.upper[i]);
  }
  return both;
}

/// Largest normal . y in a box.
template <int D>
double highest_in(const Region<D>& box, const Vector<D>& normal)
{
  double sum = 0;
  for (int i = 0; i < D; ++i)
    sum += normal[i] * (normal[i] > 0 ? box.upper[i] : box.lower[i]);
  return sum;
}

/// Bound of normal . y over the points y in a box that are on a plane through a point: normal . y less a multiple of
/// the distance from the plane, which is zero on it.
/// @param facing  normal of the plane, of length 1
template <int D>
double highest_on_plane(const Region<D>& box, const Vector<D>& normal, const Vector<D>& facing, const Vector<D>& point)
{
  const double along = dot<D>(normal, facing);
  Vector<D> rest;
  for (int i = 0; i < D; ++i)
    rest[i] = normal[i] - along * facing[i];
  return highest_in<D>(box, rest) + along * dot<D>(facing, point);
}
} // namespace mpm::contact
