#include "parallel/halo.h"

#include "parallel/migration.h"

#include <algorithm>
#include <map>

namespace mpm::parallel
{
namespace
{
/// Local corners of a cell by rising global number of their nodes: an order that all ranks agree on.
template <int D>
std::array<Index, D + 1> corners_by_number(const Mesh<D>& mesh, Index cell)
{
  std::array<Index, D + 1> nodes = mesh.cells[cell];
  std::sort(nodes.begin(), nodes.end(), [&](Index a, Index b) { return mesh.global_nodes[a] < mesh.global_nodes[b]; });
  return nodes;
}
} // namespace

template <int D>
Halos make_halos(const Mesh<D>& mesh, MPI_Comm comm)
{
  Halos halos;
  halos.cells.comm = halos.nodes.comm = comm;
  std::vector<bool> known(mesh.points.size(), false);
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (Index node : mesh.cells[c])
      known[node] = true;

  std::map<int, Link> cells, nodes;
  int size = 1;
  MPI_Comm_size(comm, &size);
  std::vector<std::vector<GlobalIndex>> cells_asked(static_cast<std::size_t>(size)), corners_asked(cells_asked);
  for (Index c = mesh.owned_cells; c < mesh.n_cells(); ++c)
  {
    const int owner = mesh.cell_owners[c];
    cells[owner].take.push_back(c);
    cells_asked[static_cast<std::size_t>(owner)].push_back(mesh.global_cells[c]);
    const auto corners = corners_by_number(mesh, c);
    for (int k = 0; k <= D; ++k)
      if (!known[corners[k]])
      {
        known[corners[k]] = true;
        nodes[owner].take.push_back(corners[k]);
        corners_asked[static_cast<std::size_t>(owner)].push_back(mesh.global_cells[c] * (D + 1) + k);
      }
  }
  const auto numbers = owned_cell_numbers(mesh);
  const auto cells_given = exchange_lists(cells_asked, comm), corners_given = exchange_lists(corners_asked, comm);
  for (int rank = 0; rank < size; ++rank)
  {
    for (GlobalIndex cell : cells_given[static_cast<std::size_t>(rank)])
      cells[rank].give.push_back(numbers.at(cell));
    for (GlobalIndex corner : corners_given[static_cast<std::size_t>(rank)])
      nodes[rank].give.push_back(corners_by_number(mesh, numbers.at(corner / (D + 1)))[corner % (D + 1)]);
  }
  for (auto& [rank, link] : cells)
    halos.cells.links.push_back({rank, std::move(link.give), std::move(link.take)});
  for (auto& [rank, link] : nodes)
    halos.nodes.links.push_back({rank, std::move(link.give), std::move(link.take)});
  return halos;
}

void update(const Halo& halo, double* values, int width)
{
  const auto w = static_cast<std::size_t>(width);
  exchange_values(halo.links, values, width, halo.comm);
  for (const Link& link : halo.links)
    for (std::size_t k = 0; k < link.take.size(); ++k)
      std::copy_n(&link.received[k * w], w, values + static_cast<std::size_t>(link.take[k]) * w);
}

template Halos make_halos(const Mesh<2>&, MPI_Comm);
template Halos make_halos(const Mesh<3>&, MPI_Comm);
} // namespace mpm::parallel
