#include "parallel/redistribution.h"

#include <algorithm>
#include <numeric>

namespace mpm::parallel
{
namespace
{
/// Ranks that send particles to this one or take some from it, by rising rank.
std::vector<int> partners(const NodeExchange& exchange, const std::vector<MigratingParticle>& migrating)
{
  std::vector<int> sends(static_cast<std::size_t>(exchange.size), 0), takes(sends), ranks;
  for (const MigratingParticle& migrant : migrating)
    sends[static_cast<std::size_t>(migrant.rank)] = 1;
  MPI_Alltoall(sends.data(), 1, MPI_INT, takes.data(), 1, MPI_INT, exchange.comm);
  for (std::size_t r = 0; r < sends.size(); ++r)
    if (sends[r] || takes[r])
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
