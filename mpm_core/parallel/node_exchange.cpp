#include "parallel/node_exchange.h"

#include "parallel/lists.h"

#include <algorithm>
#include <limits>
#include <map>
#include <unordered_map>

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

  // A directory: rank (number mod size) learns who has each node, and replies to all ranks that have it.
  const auto size = static_cast<std::size_t>(exchange.size);
  std::unordered_map<GlobalIndex, Index> local;
  std::vector<std::vector<GlobalIndex>> ask(size);
  for (Index node = 0; node < mesh.n_nodes(); ++node)
    if (exchange.owned[node])
    {
      local[mesh.global_nodes[node]] = node;
      ask[static_cast<std::size_t>(mesh.global_nodes[node]) % size].push_back(mesh.global_nodes[node]);
    }
  const auto asked = exchanged(ask, comm);
  std::map<GlobalIndex, std::vector<int>> ranks_of;
  for (std::size_t r = 0; r < size; ++r)
    for (GlobalIndex number : asked[r])
      ranks_of[number].push_back(static_cast<int>(r));
  std::vector<std::vector<GlobalIndex>> replies(size); // number, other rank, ...
  for (const auto& [number, ranks] : ranks_of)
    for (int r : ranks)
      for (int other : ranks)
        if (other != r)
          replies[static_cast<std::size_t>(r)].insert(replies[static_cast<std::size_t>(r)].end(), {number, other});
  std::map<int, std::vector<GlobalIndex>> shared;
  for (const auto& reply : exchanged(replies, comm))
    for (std::size_t k = 0; k < reply.size(); k += 2)
    {
      const GlobalIndex number = reply[k], rank = reply[k + 1];
      shared[static_cast<int>(rank)].push_back(number);
      if (rank < exchange.rank)
        exchange.owned[local[number]] = 0;
    }

  for (auto& [rank, numbers] : shared)
  {
    std::sort(numbers.begin(), numbers.end());
    NodeExchange::Neighbour neighbour{rank, {}, {}, {}};
    for (GlobalIndex number : numbers)
      neighbour.nodes.push_back(local[number]);
    exchange.shared_nodes.insert(exchange.shared_nodes.end(), neighbour.nodes.begin(), neighbour.nodes.end());
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
  std::vector<MPI_Request> requests;
  requests.reserve(2 * exchange.neighbours.size());
  const int tag = 1;
  for (auto& neighbour : exchange.neighbours)
  {
    const std::size_t length = neighbour.nodes.size() * w;
    neighbour.send.resize(length);
    neighbour.receive.resize(length);
    MPI_Irecv(neighbour.receive.data(), static_cast<int>(length), MPI_DOUBLE, neighbour.rank, tag, exchange.comm,
              &requests.emplace_back());
  }
  for (auto& neighbour : exchange.neighbours)
  {
    for (std::size_t k = 0; k < neighbour.nodes.size(); ++k)
      std::copy_n(values + static_cast<std::size_t>(neighbour.nodes[k]) * w, w, &neighbour.send[k * w]);
    MPI_Isend(neighbour.send.data(), static_cast<int>(neighbour.send.size()), MPI_DOUBLE, neighbour.rank, tag,
              exchange.comm, &requests.emplace_back());
  }
  exchange.own.resize(exchange.shared_nodes.size() * w);
  for (std::size_t k = 0; k < exchange.shared_nodes.size(); ++k)
  {
    double* value = values + static_cast<std::size_t>(exchange.shared_nodes[k]) * w;
    std::copy_n(value, w, &exchange.own[k * w]);
    std::fill_n(value, w, neutral);
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);

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
    add(exchange.neighbours[next].nodes, exchange.neighbours[next].receive);
  add(exchange.shared_nodes, exchange.own);
  for (; next < exchange.neighbours.size(); ++next)
    add(exchange.neighbours[next].nodes, exchange.neighbours[next].receive);
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
