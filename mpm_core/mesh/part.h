#pragma once
/// @file
/// A part of the mesh: the cells in which there is soil, and their nodes. A background mesh is larger than the body, so
/// loops over cells and nodes go over this part only.

#include "mesh/mesh.h"

namespace mpm::mesh
{
/// Cells and nodes in rising order, so that sums over them do not depend on how the part came about.
struct MeshPart
{
  std::vector<Index> cells;                      ///< owned ones
  std::vector<Index> nodes;                      ///< of these cells, and those that were added for themselves
  std::vector<unsigned char> has_cell, has_node; ///< 1 where a cell or node belongs to the part
};

/// The part made of these cells (in any order, also repeatedly) and their nodes, and of more nodes.
template <int D>
MeshPart make_part(const Mesh<D>& mesh, std::span<const Index> cells, std::span<const Index> more_nodes);

/// Adds cells and their nodes.
template <int D>
void add_cells(const Mesh<D>& mesh, std::span<const Index> cells, MeshPart& part);
} // namespace mpm::mesh
