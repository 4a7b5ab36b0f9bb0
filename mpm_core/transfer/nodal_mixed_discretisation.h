#pragma once
/// @file
/// Nodal mixed discretisation (NMD): the remedy of Detournay & Dzik against the locking of linear simplices.

#include "mesh/part.h"
#include "parallel/node_exchange.h"

#include <span>

namespace mpm::transfer
{
/// Volumetric strain or mean stress of a cell with its filled volume, or of a node, the mean over the cells around it
/// weighted by theirs, with their sum. Plain doubles, so that shared nodes are summed in one message.
struct VolumeMean
{
  double value;
  double volume; ///< [m^D]
};

/// Means over the filled cells around each node of a part of the mesh (method of Detournay & Dzik 2006; with volume
/// weights this followed by `mean_of_nodes` is its own transpose).
/// @param of_cell  value of a cell and its filled volume, 0 where it is empty; a callable Index -> VolumeMean
/// @note Collective
template <int D, class OfCell>
void average_over_nodes(const Mesh<D>& mesh, const MeshPart& part, OfCell&& of_cell, NodeExchange& exchange,
                        std::span<VolumeMean> nodes)
{
  for (Index node : part.nodes)
    nodes[node] = {};
  for (Index c : part.cells)
  {
    const VolumeMean cell = of_cell(c);
    for (Index node : mesh.cells[c])
    {
      nodes[node].value += cell.value * cell.volume;
      nodes[node].volume += cell.volume;
    }
  }
  sum_shared(exchange, nodes);
  for (Index node : part.nodes)
    if (nodes[node].volume > 0)
      nodes[node].value /= nodes[node].volume;
}

/// The mean of the values of a cell's nodes
template <int D>
inline double mean_of_nodes(const std::array<Index, D + 1>& cell, std::span<const VolumeMean> nodes)
{
  double sum = 0;
  for (Index node : cell)
    sum += nodes[node].value;
  return sum * (1.0 / (D + 1));
}
} // namespace mpm::transfer
