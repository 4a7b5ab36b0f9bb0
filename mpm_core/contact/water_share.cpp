#include "contact/water_share.h"

#include <algorithm>
#include <cmath>

namespace mpm::contact
{
namespace
{
/// Part of a surface that particles cover at least.
constexpr double least_cover = 0.5;

/// Distributes the values of each node over the nodes of the cells around it, so that their sum stays. The transpose of
/// this takes means over those cells.
/// @param values  of nodes, over the number of cells around them, as rows of doubles
template <int D, std::size_t N>
std::vector<std::array<double, N>> over_cells(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const Index> cells,
                                              const std::vector<std::array<double, N>>& values)
{
  std::vector<std::array<double, N>> spread(values.size(), std::array<double, N>{});
  for (Index c : cells)
  {
    std::array<double, N> mean{};
    for (Index node : mesh.cells[c])
      for (std::size_t i = 0; i < N; ++i)
        mean[i] += values[node][i] / (D + 1);
    for (Index node : mesh.cells[c])
      for (std::size_t i = 0; i < N; ++i)
        spread[node][i] += mean[i];
  }
  sum_shared(exchange, spread);
  return spread;
}
} // namespace

template <int D>
std::vector<double> areas_per_force(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const Index> cells,
                                    std::span<const SoilAround<D>> soil, std::vector<PressedNode<D>> pressed)
{
  sum_shared(exchange, pressed);
  std::vector<std::array<double, 2 * D + 1>> sums(pressed.size()); // outward, force, area
  for (std::size_t i = 0; i < sums.size(); ++i)
  {
    const double per_cell = soil[i].cells > 0 ? 1 / soil[i].cells : 0;
    for (int a = 0; a < D; ++a)
    {
      sums[i][a] = per_cell * soil[i].outward[a];
      sums[i][D + a] = per_cell * pressed[i].force[a];
    }
    sums[i][2 * D] = per_cell * pressed[i].area;
  }
  std::vector<std::array<double, 1>> ratio(sums.size());
  sums = over_cells<D>(mesh, exchange, cells, sums);
  for (std::size_t i = 0; i < sums.size(); ++i)
  {
    double squared = 0, facing = 0;
    for (int a = 0; a < D; ++a)
    {
      squared += sums[i][D + a] * sums[i][D + a];
      facing -= sums[i][a] * sums[i][D + a];
    }
    const double force = std::sqrt(squared);
    ratio[i][0] = force > 0 ? std::clamp(facing / force, 0.0, sums[i][2 * D] / least_cover) / force : 0;
  }
  ratio = over_cells<D>(mesh, exchange, cells, ratio);
  std::vector<double> areas(ratio.size());
  for (std::size_t i = 0; i < areas.size(); ++i)
    areas[i] = soil[i].cells > 0 ? ratio[i][0] / soil[i].cells : 0;
  return areas;
}

#define INSTANTIATE(D)                                                                                                 \
  template std::vector<double> areas_per_force<D>(const Mesh<D>&, NodeExchange&, std::span<const Index>,               \
                                                  std::span<const SoilAround<D>>, std::vector<PressedNode<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::contact
