#include "model/placement.h"

#include "mesh/search.h"
#include "parallel/agreement.h"
#include "parallel/far_search.h"

#include <algorithm>
#include <sstream>

namespace mpm::model
{
namespace
{
/// Where a particle is to go, and its cell there.
template <int D>
struct Destination
{
  Vector<D> position;
  GlobalIndex cell;
  int rank;
};

/// Destinations of this rank's particles, and the ranks beyond its neighbours with which it will exchange particles.
/// Points in cells that this rank knows are found here; only the others are looked for with all ranks.
template <class G, int D = G::dim>
std::vector<int> find_destinations(const Model<G>& model, const std::unordered_map<GlobalIndex, Index>& owned,
                                   std::vector<Destination<D>>& destinations)
{
  const Mesh<D>& mesh = model.mesh;
  std::vector<LostPoint<D>> lost;
  std::vector<std::size_t> rows;
  for (std::size_t p = 0; p < destinations.size(); ++p)
  {
    Destination<D>& to = destinations[p];
    const Index cell = find_cell<D>(mesh, to.position, model.particles.cell[p]).cell;
    if (cell != none && is_within_reach(model.exchange, mesh.cell_owners[cell]))
    {
      to.cell = mesh.global_cells[cell];
      to.rank = mesh.cell_owners[cell];
      continue;
    }
    lost.push_back({to.position, model.particles.cell[p]});
    rows.push_back(p);
  }
  const FarSearch search = find_far<D>(mesh, owned, model.exchange, lost);
  for (std::size_t k = 0; k < rows.size(); ++k)
  {
    destinations[rows[k]].cell = search.places[k].cell;
    destinations[rows[k]].rank = search.places[k].rank;
  }
  return search.partners;
}

/// @throws InputError naming the first particle without a cell
template <class G, int D = G::dim>
void require_cells(const Model<G>& model, const std::vector<Destination<D>>& destinations)
{
  const auto outside =
      std::find_if(destinations.begin(), destinations.end(), [](const auto& to) { return to.cell == none; });
  if (outside == destinations.end())
    return;
  std::ostringstream out;
  out.precision(9);
  out << "position of particle " << model.particles.id[static_cast<std::size_t>(outside - destinations.begin())]
      << " is (";
  for (int i = 0; i < D; ++i)
    out << (i ? ", " : "") << outside->position[i];
  out << ") m, which is outside of the mesh";
  throw InputError(out.str());
}
} // namespace

template <class G>
void place_particles(Model<G>& model, std::span<const double> positions)
{
  constexpr int D = G::dim;
  Particles<D>& particles = model.particles;
  const auto n = static_cast<std::size_t>(particles.size());
  std::vector<Destination<D>> destinations(n);
  for (std::size_t p = 0; p < n; ++p)
    std::copy_n(&positions[p * D], D, destinations[p].position.begin());
  const auto owned = owned_cell_numbers(model.mesh);
  const std::vector<int> partners = find_destinations(model, owned, destinations);
  collectively(model.exchange.comm, [&] { require_cells(model, destinations); });

  std::vector<MigratingParticle> migrating;
  for (std::size_t p = 0; p < n; ++p)
  {
    for (int i = 0; i < D; ++i)
      particles.position[static_cast<std::size_t>(i)][p] = destinations[p].position[i];
    if (destinations[p].rank == model.exchange.rank)
      particles.cell[p] = owned.at(destinations[p].cell);
    else
      migrating.push_back({static_cast<Index>(p), destinations[p].cell, destinations[p].rank});
  }
  migrate<D>(owned, model.exchange, {migrating, {}, partners}, particles);
  model.ready = false;
}

template void place_particles(Model<PlaneStrain>&, std::span<const double>);
template void place_particles(Model<Axisymmetric>&, std::span<const double>);
template void place_particles(Model<Solid>&, std::span<const double>);
} // namespace mpm::model
