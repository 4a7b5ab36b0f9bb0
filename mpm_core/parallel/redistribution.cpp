#include "parallel/redistribution.h"

#include "parallel/agreement.h"
#include "parallel/lists.h"

#include <algorithm>
#include <numeric>

namespace mpm::parallel
{
namespace
{
using Lists = std::vector<std::vector<GlobalIndex>>;

/// Ranks that own cells, -1 where none does. Rank (number mod size) keeps the directory of a cell.
template <int D>
std::vector<int> owners(const Mesh<D>& mesh, const NodeExchange& exchange, std::span<const GlobalIndex> cells)
{
  const auto size = static_cast<std::size_t>(exchange.size);
  auto keeper = [size](GlobalIndex cell) { return static_cast<std::size_t>(cell) % size; };
  Lists owned(size), asked(size);
  for (Index c = 0; c < mesh.owned_cells; ++c)
    owned[keeper(mesh.global_cells[c])].push_back(mesh.global_cells[c]);
  for (GlobalIndex cell : cells)
    asked[keeper(cell)].push_back(cell);
  std::unordered_map<GlobalIndex, GlobalIndex> directory;
  const Lists registered = exchanged(owned, exchange.comm);
  for (std::size_t r = 0; r < size; ++r)
    for (GlobalIndex cell : registered[r])
      directory[cell] = static_cast<GlobalIndex>(r);
  Lists questions = exchanged(asked, exchange.comm);
  for (auto& list : questions)
    for (GlobalIndex& entry : list)
    {
      const auto found = directory.find(entry);
      entry = found == directory.end() ? -1 : found->second;
    }
  const Lists replies = exchanged(questions, exchange.comm);
  std::vector<int> ranks;
  std::vector<std::size_t> next(size, 0);
  for (GlobalIndex cell : cells)
    ranks.push_back(static_cast<int>(replies[keeper(cell)][next[keeper(cell)]++]));
  return ranks;
}

/// Ranks that send particles to this one or take some from it, by rising rank.
std::vector<int> partners(const NodeExchange& exchange, const std::vector<MigratingParticle>& migrating)
{
  Lists counts(static_cast<std::size_t>(exchange.size));
  for (const MigratingParticle& migrant : migrating)
    counts[static_cast<std::size_t>(migrant.rank)].resize(1, 1);
  const Lists received = exchanged(counts, exchange.comm);
  std::vector<int> ranks;
  for (std::size_t r = 0; r < counts.size(); ++r)
    if (!counts[r].empty() || !received[r].empty())
      ranks.push_back(static_cast<int>(r));
  return ranks;
}
} // namespace

template <int D>
void redistribute(const Mesh<D>& mesh, const NodeExchange& exchange, std::span<const GlobalIndex> cells,
                  Particles<D>& particles)
{
  const auto numbers = owned_cell_numbers(mesh);
  const std::vector<int> ranks = owners(mesh, exchange, cells);
  std::string failure;
  for (std::size_t p = 0; p < ranks.size() && failure.empty(); ++p)
    if (ranks[p] < 0)
      failure = "particle " + std::to_string(particles.id[p]) + " is in cell " + std::to_string(cells[p]) +
                ", which no rank has";
  if (const std::string text = shared_failure(exchange.comm, failure); !text.empty())
    throw RunError(text);

  std::vector<MigratingParticle> migrating;
  for (std::size_t p = 0; p < ranks.size(); ++p)
    if (ranks[p] != exchange.rank)
      migrating.push_back({static_cast<Index>(p), cells[p], ranks[p]});
    else
      particles.cell[p] = numbers.at(cells[p]);
  const std::vector<int> far = partners(exchange, migrating);
  migrate<D>(numbers, exchange, {migrating, {}, far}, particles);

  std::vector<Index> order(particles.id.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return particles.id[a] < particles.id[b]; });
  reorder<D>(particles, order);
}

template void redistribute(const Mesh<2>&, const NodeExchange&, std::span<const GlobalIndex>, Particles<2>&);
template void redistribute(const Mesh<3>&, const NodeExchange&, std::span<const GlobalIndex>, Particles<3>&);
} // namespace mpm::parallel
