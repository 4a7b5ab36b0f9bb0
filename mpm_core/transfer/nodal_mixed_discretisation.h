#pragma once
/// @file
/// Nodal mixed discretisation (NMD): the remedy of Detournay & Dzik against the locking of linear simplices.

#include "mesh/part.h"
#include "parallel/rounded_sums.h"

#include <span>

namespace mpm::transfer
{
/// Volumetric strain or mean stress of a node: the mean over the cells around it, weighted by their filled volumes, and
/// the sum of these. Plain doubles, so that shared nodes are summed in one message.
struct VolumeMean
{
  double value;
  double volume; ///< [m^D]
};

/// Means over the filled cells around each node of a part of the mesh (method of Detournay & Dzik 2006; with volume
/// weights this followed by `mean_of_nodes` is its own transpose).
/// @param volume_of    filled volume of a cell, 0 where it is empty; a callable Index -> double
/// @param integral_of  what is averaged, integrated over a filled cell; a callable (Index, volume) -> double
/// @note Collective
template <int D, class VolumeOf, class IntegralOf>
void average_over_nodes(const Mesh<D>& mesh, const MeshPart& part, VolumeOf&& volume_of, IntegralOf&& integral_of,
                        NodeExchange& exchange, std::span<VolumeMean> nodes)
{
  const auto each_term = [&](auto&& add)
  {
    for (Index c : part.cells)
    {
      const double volume = volume_of(c);
      if (volume == 0)
        continue;
      const VolumeMean term{integral_of(c, volume), volume};
      for (Index node : mesh.cells[c])
        add(node, term);
    }
  };
  for (Index node : part.nodes)
    nodes[node] = {};
  sum_at_nodes<VolumeMean>(
      exchange, [nodes](Index node) -> VolumeMean& { return nodes[node]; }, each_term);
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
