#include "parallel/node_exchange.h"

#include <algorithm>
#include <limits>
#include <map>

namespace mpm::parallel
{
template <int D>
NodeExchange make_node_exchange(const Mesh<D>& mesh, MPI_Comm comm)
{
  NodeExchange exchange;
  exchange.comm = comm;
  MPI_Comm_rank(comm, &exchange.rank);
  MPI_Comm_size(comm, &exchange.size);
  exchange.owned.assign(mesh.points.size(), 0);
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (Index node : mesh.cells[c])
      exchange.owned[node] = 1;
  if (exchange.size == 1)
    return exchange;

  std::vector<GlobalIndex> numbers, nodes;
  for (Index node = 0; node < mesh.n_nodes(); ++node)
    if (exchange.owned[node])
    {
      numbers.push_back(mesh.global_nodes[node]);
      nodes.push_back(node);
    }
  const auto holders = find_holders(numbers, nodes, numbers, comm);
  std::map<int, std::vector<std::pair<GlobalIndex, Index>>> shared; // by rank: global number, node
  for (std::size_t k = 0; k < nodes.size(); ++k)
    for (const Holder& holder : holders[k])
      if (holder.rank != exchange.rank)
      {
        const auto node = static_cast<Index>(nodes[k]);
        shared[holder.rank].emplace_back(numbers[k], node);
        if (holder.rank < exchange.rank)
          exchange.owned[node] = 0;
      }

  for (auto& [rank, pairs] : shared)
  {
    std::sort(pairs.begin(), pairs.end());
    Link neighbour{rank, {}, {}};
    for (const auto& pair : pairs)
      neighbour.give.push_back(pair.second);
    neighbour.take = neighbour.give;
    exchange.shared_nodes.insert(exchange.shared_nodes.end(), neighbour.give.begin(), neighbour.give.end());
    exchange.neighbours.push_back(std::move(neighbour));
  }
  std::sort(exchange.shared_nodes.begin(), exchange.shared_nodes.end());
  exchange.shared_nodes.erase(std::unique(exchange.shared_nodes.begin(), exchange.shared_nodes.end()),
                              exchange.shared_nodes.end());
  return exchange;
}

namespace
{
/// Replaces the values of shared nodes by what `combine` makes of those of all ranks that share them, by rising rank.
template <class Combine>
void combine_shared(NodeExchange& exchange, double* values, int width, double neutral, Combine&& combine)
{
  if (exchange.neighbours.empty())
    return;
  const auto w = static_cast<std::size_t>(width);
  exchange_values(exchange.neighbours, values, width, exchange.comm);
  exchange.own.resize(exchange.shared_nodes.size() * w);
  for (std::size_t k = 0; k < exchange.shared_nodes.size(); ++k)
  {
    double* value = values + static_cast<std::size_t>(exchange.shared_nodes[k]) * w;
    std::copy_n(value, w, &exchange.own[k * w]);
    std::fill_n(value, w, neutral);
  }

  auto add = [&](const std::vector<Index>& nodes, const std::vector<double>& terms)
  {
    for (std::size_t k = 0; k < nodes.size(); ++k)
      for (std::size_t i = 0; i < w; ++i)
      {
        double& value = values[static_cast<std::size_t>(nodes[k]) * w + i];
        value = combine(value, terms[k * w + i]);
      }
  };
  std::size_t next = 0;
  for (; next < exchange.neighbours.size() && exchange.neighbours[next].rank < exchange.rank; ++next)
    add(exchange.neighbours[next].take, exchange.neighbours[next].received);
  add(exchange.shared_nodes, exchange.own);
  for (; next < exchange.neighbours.size(); ++next)
    add(exchange.neighbours[next].take, exchange.neighbours[next].received);
}
} // namespace

void sum_shared(NodeExchange& exchange, double* values, int width)
{
  combine_shared(exchange, values, width, 0.0, [](double a, double b) { return a + b; });
}

void max_shared(NodeExchange& exchange, double* values, int width)
{
  combine_shared(exchange, values, width, -std::numeric_limits<double>::infinity(),
                 [](double a, double b) { return std::max(a, b); });
}

template NodeExchange make_node_exchange(const Mesh<2>&, MPI_Comm);
template NodeExchange make_node_exchange(const Mesh<3>&, MPI_Comm);
} // namespace mpm::parallel
