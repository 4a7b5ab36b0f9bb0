#include "parallel/redistribution.h"

#include <algorithm>
#include <numeric>

namespace mpm::parallel
{
namespace
{
using Lists = std::vector<std::vector<GlobalIndex>>;

/// Ranks that send particles to this one or take some from it, by rising rank.
std::vector<int> partners(const NodeExchange& exchange, const std::vector<MigratingParticle>& migrating)
{
  Lists counts(static_cast<std::size_t>(exchange.size));
  for (const MigratingParticle& migrant : migrating)
    counts[static_cast<std::size_t>(migrant.rank)].resize(1, 1);
  const Lists received = exchange_lists(counts, exchange.comm);
  std::vector<int> ranks;
  for (std::size_t r = 0; r < counts.size(); ++r)
    if (!counts[r].empty() || !received[r].empty())
      ranks.push_back(static_cast<int>(r));
  return ranks;
}
} // namespace

template <int D>
void redistribute(const Mesh<D>& mesh, const NodeExchange& exchange, std::span<const GlobalIndex> cells,
                  std::span<const GlobalIndex> owners, Particles<D>& particles)
{
  const auto numbers = owned_cell_numbers(mesh);
  std::vector<MigratingParticle> migrating;
  for (std::size_t p = 0; p < owners.size(); ++p)
    if (owners[p] != exchange.rank)
      migrating.push_back({static_cast<Index>(p), cells[p], static_cast<int>(owners[p])});
    else
      particles.cell[p] = numbers.at(cells[p]);
  const std::vector<int> far = partners(exchange, migrating);
  migrate<D>(numbers, exchange, {migrating, {}, far}, particles);

  std::vector<Index> order(particles.id.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return particles.id[a] < particles.id[b]; });
  reorder<D>(particles, order);
}

template void redistribute(const Mesh<2>&, const NodeExchange&, std::span<const GlobalIndex>,
                           std::span<const GlobalIndex>, Particles<2>&);
template void redistribute(const Mesh<3>&, const NodeExchange&, std::span<const GlobalIndex>,
                           std::span<const GlobalIndex>, Particles<3>&);
} // namespace mpm::parallel
