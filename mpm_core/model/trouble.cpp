#include "model/model.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// Finds the particles that no local cell holds, and puts each on the list of leavers or of outflow, or notes trouble.
template <int D>
void place_lost(Model<D>& model)
{
  Workspace<D>& work = model.work;
  std::vector<LostPoint<D>> points;
  for (Index p : work.lost)
    points.push_back({at<D>(model.particles.position, p), model.particles.cell[p]});
  FarSearch search = find_far<D>(model.mesh, work.owned_cells, model.exchange, points);
  const auto& tags = model.outflow_tags;
  for (std::size_t k = 0; k < points.size(); ++k)
  {
    const Place& place = search.places[k];
    if (place.cell != none)
      work.leavers.push_back({work.lost[k], place.cell, place.rank});
    else if (std::find(tags.begin(), tags.end(), place.exit_tag) != tags.end())
      work.outflow.push_back(work.lost[k]);
    else
      note_trouble<D>(model, Trouble<D>::Kind::left_mesh, work.lost[k], {});
  }
  work.far_partners = std::move(search.partners);
  work.lost.clear();
  // Messages and sums follow these lists, so their order must not depend on who was lost.
  std::sort(work.leavers.begin(), work.leavers.end(),
            [](const Leaver& a, const Leaver& b) { return a.particle < b.particle; });
  std::sort(work.outflow.begin(), work.outflow.end());
}
} // namespace

template <int D>
Trouble<D> trouble_with(const Model<D>& model, typename Trouble<D>::Kind kind, Index particle,
                        const SymTensor<D>& strain_increment)
{
  const Particles<D>& particles = model.particles;
  return {kind,
          particles.material[particle],
          particles.id[particle],
          at<D>(particles.position, particle),
          at<D>(particles.velocity, particle),
          strain_increment};
}

template <int D>
void note_trouble(Model<D>& model, typename Trouble<D>::Kind kind, Index particle, const SymTensor<D>& strain_increment)
{
  if (!model.work.trouble)
    model.work.trouble = trouble_with(model, kind, particle, strain_increment);
}

template <int D>
std::optional<Trouble<D>> shared_trouble(const NodeExchange& exchange, const std::optional<Trouble<D>>& own)
{
  int rank = own ? exchange.rank : exchange.size;
  MPI_Allreduce(MPI_IN_PLACE, &rank, 1, MPI_INT, MPI_MIN, exchange.comm);
  if (rank == exchange.size)
    return {};
  Trouble<D> trouble = own.value_or(Trouble<D>{});
  MPI_Bcast(&trouble, sizeof(trouble), MPI_BYTE, rank, exchange.comm);
  return trouble;
}

template <int D>
void agree_on_trouble(Model<D>& model)
{
  const NodeExchange& exchange = model.exchange;
  Workspace<D>& work = model.work;
  std::array<int, 2> all_well{!work.trouble, work.lost.empty()};
  MPI_Allreduce(MPI_IN_PLACE, all_well.data(), 2, MPI_INT, MPI_MIN, exchange.comm);
  if (!all_well[1])
    place_lost(model);
  if (!all_well[0] || !all_well[1])
    work.trouble = shared_trouble(exchange, work.trouble);
}

#define INSTANTIATE(D)                                                                                                 \
  template Trouble<D> trouble_with<D>(const Model<D>&, Trouble<D>::Kind, Index, const SymTensor<D>&);                  \
  template std::optional<Trouble<D>> shared_trouble(const NodeExchange&, const std::optional<Trouble<D>>&);            \
  template void note_trouble<D>(Model<D>&, Trouble<D>::Kind, Index, const SymTensor<D>&);                              \
  template void agree_on_trouble(Model<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
