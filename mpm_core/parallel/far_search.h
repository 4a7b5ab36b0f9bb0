#pragma once
/// @file
/// Finding the cells of points anywhere in a mesh that is spread over ranks.

#include "parallel/node_exchange.h"

#include <unordered_map>

namespace mpm::parallel
{
/// A point of this rank, and the owned cell from which to walk to it.
template <int D>
struct LostPoint
{
  Vector<D> position;
  Index start;
};

/// Where a point is, over all ranks.
struct Place
{
  GlobalIndex cell = none; ///< its cell, or `none` when it is outside of the mesh
  int rank = -1;           ///< that owns the cell
  Index exit_tag = none;   ///< for a point outside: tag of the facet through which the walk left the mesh
};

struct FarSearch
{
  std::vector<Place> places; ///< one for each point of this rank
  std::vector<int>
      partners; ///< ranks that hold one of this rank's points, or own one that this rank holds; by rising rank
};

/// Places of points that are anywhere in the mesh. The walk goes on from rank to rank, and where it ends outside of the
/// mesh all ranks look into their bins, so that the result is that of `find_cell` on one rank.
/// @param owned_cells  local number of each owned cell, by its global number
/// @note Collective over all ranks
template <int D>
FarSearch find_far(const Mesh<D>& mesh, const std::unordered_map<GlobalIndex, Index>& owned_cells,
                   const NodeExchange& exchange, std::span<const LostPoint<D>> points);
} // namespace mpm::parallel
