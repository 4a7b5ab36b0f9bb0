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

/// Whether the border of a surface may pass through a region.
bool has_border(const Triangles& surface, const Region<3>& region);
} // namespace mpm::contact
