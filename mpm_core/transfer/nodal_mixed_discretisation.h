#pragma once
/// @file
/// Nodal mixed discretisation (NMD): the remedy of Detournay & Dzik against the locking of linear simplices.

#include "mesh/part.h"
#include "parallel/rounded_sums.h"

#include <span>
#include <vector>

namespace mpm::transfer
{
/// Volumetric strain or mean stress of a node: the mean over the cells around it, weighted by their filled volumes, and
/// the sum of these. Plain doubles, so that shared nodes are summed in one message.
struct VolumeMean
{
  double value;
  double volume; ///< [m^D]
};

/// Groups of cells that are averaged apart, each with a mean of its own at a node: soils that differ in stiffness.
struct AveragedGroups
{
  int count = 1;
  std::vector<Index> of_cell; ///< per owned cell; empty where there is one group
};

/// Where the means of a cell's vertices are: node by node, those of all groups of a node one after the other.
template <int D>
inline std::array<Index, D + 1> means_of(const Mesh<D>& mesh, const AveragedGroups& groups, Index cell)
{
  std::array<Index, D + 1> means = mesh.cells[cell];
  if (!groups.of_cell.empty())
    for (Index& mean : means)
      mean = mean * groups.count + groups.of_cell[cell];
  return means;
}

/// Sums terms of the cells of a part of the mesh at the means of their vertices, over all ranks.
/// @param means     sums, zero before, for each node as many as there are groups
/// @param add_cell  calls its second argument, a callable (int vertex, const T& term), with the terms of a cell; a
///                  callable (Index cell, auto&& add)
/// @note Collective
template <class T, int D, class AddCell>
void sum_at_means(const Mesh<D>& mesh, const MeshPart& part, const AveragedGroups& groups, NodeExchange& exchange,
                  std::span<T> means, AddCell&& add_cell)
{
  const auto each_term = [&](auto&& add)
  {
    for (Index c : part.cells)
    {
      const auto places = means_of(mesh, groups, c);
      add_cell(c, [&](int k, const T& term) { add(places[k], term); });
    }
  };
  sum_at_nodes<T>(
      exchange, [means](Index mean) -> T& { return means[mean]; }, each_term, groups.count);
  sum_shared(exchange, means, groups.count);
}

/// Means over the filled cells of each group around each node of a part of the mesh (method of Detournay & Dzik 2006;
/// with volume weights this followed by `mean_of_vertices` is its own transpose).
/// @param volume_of    filled volume of a cell, 0 where it is empty; a callable Index -> double
/// @param integral_of  what is averaged, integrated over a filled cell; a callable (Index, volume) -> double
/// @note Collective
template <int D, class VolumeOf, class IntegralOf>
void average_over_nodes(const Mesh<D>& mesh, const MeshPart& part, const AveragedGroups& groups, VolumeOf&& volume_of,
                        IntegralOf&& integral_of, NodeExchange& exchange, std::vector<VolumeMean>& means)
{
  means.resize(static_cast<std::size_t>(groups.count) * mesh.points.size());
  const auto for_each_mean = [&part, first = means.data(), count = groups.count](auto&& work)
  {
    for (int group = 0; group < count; ++group)
      for (Index node : part.nodes)
        work(first[node * count + group]);
  };
  for_each_mean([](VolumeMean& mean) { mean = {}; });
  const auto add_cell = [&](Index c, auto&& add)
  {
    const double volume = volume_of(c);
    if (volume == 0)
      return;
    const VolumeMean term{integral_of(c, volume), volume};
    for (int k = 0; k <= D; ++k)
      add(k, term);
  };
  sum_at_means<VolumeMean>(mesh, part, groups, exchange, std::span(means), add_cell);
  for_each_mean(
      [](VolumeMean& mean)
      {
        if (mean.volume > 0)
          mean.value /= mean.volume;
      });
}

/// The mean of the values at a cell's vertices, of its group.
template <int D>
inline double mean_of_vertices(const Mesh<D>& mesh, const AveragedGroups& groups, Index cell,
                               std::span<const VolumeMean> means)
{
  double sum = 0;
  for (Index mean : means_of(mesh, groups, cell))
    sum += means[mean].value;
  return sum * (1.0 / (D + 1));
}
} // namespace mpm::transfer
