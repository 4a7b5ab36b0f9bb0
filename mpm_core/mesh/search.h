#pragma once
/// @file
/// Finding the cell of a point.

#include "mesh/mesh.h"

#include <algorithm>

namespace mpm::mesh
{
/// A point belongs to a cell when no shape function is below minus this: points on a facet must not fall between cells.
/// It is more where coordinates are far from their origin, as those of maps are; see `inside_tolerance_of`.
inline constexpr double inside_tolerance = 1e-10;

template <int D>
inline double inside_tolerance_of(const Mesh<D>& mesh)
{
  return std::max(inside_tolerance, 10 * mesh.round_off); // a shape function is a sum of some products with this error
}

/// Where a point is.
struct Location
{
  /// Its cell, or `none` when it is outside of the mesh
  Index cell = none;
  /// For a point outside: the cell and facet (opposite to this vertex) through which the walk left the mesh
  Index exit_cell = none;
  int exit_facet = -1;
};

/// The walk of `find_cell` alone, without the bins; where it ends outside, or goes round in circles, `exit_cell` is the
/// last one.
template <int D>
Location walk_to_cell(const Mesh<D>& mesh, const Vector<D>& x, Index start);

/// The cell of point x, found by walking from cell `start` over neighbours, each time across the facet that x lies
/// farthest behind. Where the walk ends at a boundary or goes round in circles, the bins of the mesh decide, so the
/// result is correct on any mesh. A point that is not finite is outside.
template <int D>
Location find_cell(const Mesh<D>& mesh, const Vector<D>& x, Index start);

/// The cell of point x without a guess, by the bins of the mesh; `none` when outside.
template <int D>
Index find_cell_in_bins(const Mesh<D>& mesh, const Vector<D>& x);
} // namespace mpm::mesh
