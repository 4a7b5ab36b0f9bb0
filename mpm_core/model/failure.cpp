#include "model/model.h"

#include <algorithm>

namespace mpm::model
{
namespace
{
/// Finds the particles that no local cell holds, and puts each on the list of migrating or of outflow, or notes a
/// failure.
template <class G, int D = G::dim>
void place_lost(Model<G>& model)
{
  Migration& migration = model.migration;
  std::vector<LostPoint<D>> points;
  for (Index p : migration.lost)
    points.push_back({at<D>(model.particles.position, p), model.particles.cell[p]});
  FarSearch search = find_far<D>(model.mesh, migration.owned_cells, model.exchange, points);
  const auto& tags = model.outflow_tags;
  for (std::size_t k = 0; k < points.size(); ++k)
  {
    const Place& place = search.places[k];
    const Index p = migration.lost[k];
    if (place.cell != none)
      migration.migrating.push_back({p, place.cell, place.rank});
    else if (std::find(tags.begin(), tags.end(), place.exit_tag) != tags.end())
      migration.outflow.push_back(p);
    else
      note_failure<D>(model.failure, model.particles, Failure<D>::Kind::left_mesh, p, {});
  }
  migration.far_partners = std::move(search.partners);
  migration.lost.clear();
  // Messages and sums follow these lists, so their order must not depend on who was lost.
  std::ranges::sort(migration.migrating, {}, &MigratingParticle::particle);
  std::ranges::sort(migration.outflow);
}
} // namespace

template <int D>
Failure<D> failure_of(const Particles<D>& particles, typename Failure<D>::Kind kind, Index particle,
                      const SymTensor<D>& strain_increment)
{
  return {kind,
          particles.material[particle],
          particles.id[particle],
          at<D>(particles.position, particle),
          at<D>(particles.velocity, particle),
          strain_increment};
}

template <int D>
void note_failure(std::optional<Failure<D>>& failure, const Particles<D>& particles, typename Failure<D>::Kind kind,
                  Index particle, const SymTensor<D>& strain_increment)
{
  if (!failure)
    failure = failure_of(particles, kind, particle, strain_increment);
}

template <int D>
std::optional<Failure<D>> shared_failure(const NodeExchange& exchange, const std::optional<Failure<D>>& own)
{
  int rank = own ? exchange.rank : exchange.size;
  MPI_Allreduce(MPI_IN_PLACE, &rank, 1, MPI_INT, MPI_MIN, exchange.comm);
  if (rank == exchange.size)
    return {};
  Failure<D> failure = own.value_or(Failure<D>{});
  MPI_Bcast(&failure, sizeof(failure), MPI_BYTE, rank, exchange.comm);
  return failure;
}

template <class G>
void agree_on_failure(Model<G>& model)
{
  const NodeExchange& exchange = model.exchange;
  std::array<int, 2> all_well{!model.failure, model.migration.lost.empty()};
  MPI_Allreduce(MPI_IN_PLACE, all_well.data(), 2, MPI_INT, MPI_MIN, exchange.comm);
  if (!all_well[1])
    place_lost(model);
  if (!all_well[0] || !all_well[1])
    model.failure = shared_failure(exchange, model.failure);
}

#define INSTANTIATE(D)                                                                                                 \
  template Failure<D> failure_of<D>(const Particles<D>&, Failure<D>::Kind, Index, const SymTensor<D>&);                \
  template std::optional<Failure<D>> shared_failure(const NodeExchange&, const std::optional<Failure<D>>&);            \
  template void note_failure<D>(std::optional<Failure<D>>&, const Particles<D>&, Failure<D>::Kind, Index,              \
                                const SymTensor<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
template void agree_on_failure(Model<PlaneStrain>&);
template void agree_on_failure(Model<Axisymmetric>&);
template void agree_on_failure(Model<Solid>&);
} // namespace mpm::model
