#pragma once
/// @file
/// Nodal mixed discretisation (NMD): the remedy of Detournay & Dzik against the locking of linear simplices.

#include "mesh/part.h"
#include "parallel/node_exchange.h"

#include <span>

namespace mpm
{
/// Volumetric strain of a cell with its filled volume, or of a node, the average over the cells around it weighted by
/// theirs, with their sum. Plain doubles, so that shared nodes are summed in one message.
struct VolumetricStrain
{
  double value;
  double volume; ///< [m^D]
};

/// Volumetric strains at the nodes of a part of the mesh: averages over the filled cells around each node (method of
/// Detournay & Dzik 2006; volume weights keep the tangent symmetric).
/// @param of_cell  strain of a cell and its filled volume, 0 where it is empty; a callable Index -> VolumetricStrain
/// @note Collective
template <int D, class OfCell>
void average_volumetric_strain(const Mesh<D>& mesh, const MeshPart& part, OfCell&& of_cell, NodeExchange& exchange,
                               std::span<VolumetricStrain> nodes)
{
  for (Index node : part.nodes)
    nodes[node] = {};
  for (Index c : part.cells)
  {
    const VolumetricStrain cell = of_cell(c);
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

/// Volumetric strain of a cell: the mean of its nodes' values.
template <int D>
inline double mean_volumetric_strain(const std::array<Index, D + 1>& cell, std::span<const VolumetricStrain> nodes)
{
  double sum = 0;
  for (Index node : cell)
    sum += nodes[node].value;
  return sum * (1.0 / (D + 1));
}
} // namespace mpm
