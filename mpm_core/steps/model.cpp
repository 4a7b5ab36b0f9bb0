#include "steps/model.h"

#include "parallel/agreement.h"

#include <algorithm>
#include <cmath>

namespace mpm
{
namespace
{
template <int D>
void check_particles(const Particles<D>& particles)
{
  for_each_column(particles,
                  [&](const char* name, int, const auto& column)
                  {
                    for (std::size_t p = 0; p < column.size(); ++p)
                      if (!std::isfinite(static_cast<double>(column[p])))
                        throw InputError(std::string(name) + " of particle " + std::to_string(particles.id[p]) +
                                         " is " + std::to_string(column[p]) + ", expected a finite number");
                  });
  for (std::size_t p = 0; p < particles.id.size(); ++p)
    if (!(particles.mass[p] > 0 && particles.volume[p] > 0))
      throw InputError("mass and volume of particle " + std::to_string(particles.id[p]) + " are " +
                       std::to_string(particles.mass[p]) + " and " + std::to_string(particles.volume[p]) +
                       ", expected positive numbers");
}
} // namespace

template <int D>
void sort_particles(Model<D>& model)
{
  sort_by_cell<D>(model.particles, model.mesh.owned_cells, static_cast<Index>(model.laws.size()));
  find_runs<D>(model.particles, batch_size, model.work.runs);
  model.work.last_sort = model.totals.steps;
  model.work.strays = 0;
  ++model.totals.sorts;
}

template <int D>
Inventory taken_inventory(const Model<D>& model)
{
  std::array<double, 2> sums{static_cast<double>(model.particles.size() + model.totals.outflow_particles),
                             model.totals.outflow_mass};
  for (double mass : model.particles.mass)
    sums[1] += mass;
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  return {sums[0], sums[1]};
}

template <int D>
void prepare(Model<D>& model)
{
  Workspace<D>& work = model.work;
  if (work.ready)
    return;
  collectively(model.exchange.comm, [&] { check_particles(model.particles); });
  const auto nodes = model.mesh.points.size(), cells = static_cast<std::size_t>(model.mesh.owned_cells);
  work.nodes.resize(nodes);
  work.start_velocity.resize(nodes);
  work.acceleration.resize(nodes);
  work.velocity.resize(nodes);
  work.cell_volume.resize(cells);
  work.volumetric_strain.resize(cells);
  work.owned_cells = owned_cell_numbers(model.mesh);

  sort_particles(model);
  work.moments.assign(cells, CellMoments<D>{});
  // A rank without particles must still agree with the others on what is exchanged.
  int loaded = model.particles.loaded;
  MPI_Allreduce(MPI_IN_PLACE, &loaded, 1, MPI_INT, MPI_MAX, model.exchange.comm);
  if (loaded)
    require_traction(model.particles);
  work.tractions.assign(loaded ? cells : 0, TractionMoments<D>{});
  for (const Run& run : work.runs)
  {
    gather<D>(model.particles, run.first, run.last, model.mesh.shapes[run.cell], work.moments[run.cell]);
    if (loaded)
      gather<D>(model.particles, run.first, run.last, model.mesh.shapes[run.cell], work.tractions[run.cell]);
  }
  // Only particles within round-off of the opposite facet touch a node with less than this share of a whole particle's
  // mass.
  const auto heaviest = std::max_element(model.particles.mass.begin(), model.particles.mass.end());
  work.least_mass = heaviest == model.particles.mass.end() ? 0 : 1e-12 * *heaviest;
  MPI_Allreduce(MPI_IN_PLACE, &work.least_mass, 1, MPI_DOUBLE, MPI_MAX, model.exchange.comm);
  model.inventory = taken_inventory(model);
  work.ready = true;
}

template void prepare(Model<2>&);
template void prepare(Model<3>&);
template Inventory taken_inventory(const Model<2>&);
template Inventory taken_inventory(const Model<3>&);
template void sort_particles(Model<2>&);
template void sort_particles(Model<3>&);
} // namespace mpm
