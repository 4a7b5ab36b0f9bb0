#include "model/model.h"

#include "model/mapping.h"
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
                  [&](std::string_view name, int, const auto& column)
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
  find_cell_runs(model, false);
  model.work.soil_shrinks = true;
  model.work.strays = 0;
  model.work.stray_steps = 0;
  ++model.totals.sorts;
}

template <int D>
void find_cell_runs(Model<D>& model, bool again)
{
  Workspace<D>& work = model.work;
  if (again)
    find_runs_again<D>(model.particles, batch_size, work.runs);
  else
    find_runs<D>(model.particles, batch_size, work.runs);
  work.cell_marks.resize(model.mesh.cells.size(), 0);
  for (Run& run : work.runs)
  {
    run.first_in_cell = !work.cell_marks[run.cell];
    work.cell_marks[run.cell] = 1;
  }
  for (Index c : work.left)
    if (!work.cell_marks[c])
    {
      work.moments[c] = {};
      if (!work.tractions.empty())
        work.tractions[c] = {};
    }
  work.left.clear();
  for (const Run& run : work.runs)
    work.cell_marks[run.cell] = 0;
}

template <int D>
void shrink_soil(Model<D>& model)
{
  Workspace<D>& work = model.work;
  if (!work.soil_shrinks)
    return;
  std::vector<Index> cells;
  for (const Run& run : work.runs)
    cells.push_back(run.cell);
  const std::vector<Index> before = std::move(work.soil.nodes);
  work.soil = make_part<D>(model.mesh, cells, model.exchange.shared_nodes);
  for (Index node : before)
    if (!work.soil.has_node[node])
    {
      work.nodes[node] = {};
      work.start_velocity[node] = work.acceleration[node] = work.velocity_change[node] = work.velocity[node] = {};
    }
  work.soil_shrinks = false;
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
  work.nodes.assign(nodes, {});
  for (auto* values : {&work.start_velocity, &work.acceleration, &work.velocity_change, &work.velocity})
    values->assign(nodes, {});
  work.volumetric_strain.resize(nodes);
  work.soil = {};
  work.owned_cells = owned_cell_numbers(model.mesh);

  sort_particles(model);
  work.moments.assign(cells, CellMoments<D>{});
  agree_on_fields(model.particles, model.exchange.comm);
  const bool loaded = model.particles.traction.present;
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
  if (model.energy.stale)
    start_energy_balance(model);

  map_to_nodes(model); // what nodes are at the start may be looked at before a step
  find_start_velocity(model);
  work.velocity = work.start_velocity;
}

template void prepare(Model<2>&);
template void prepare(Model<3>&);
template Inventory taken_inventory(const Model<2>&);
template Inventory taken_inventory(const Model<3>&);
template void sort_particles(Model<2>&);
template void sort_particles(Model<3>&);
template void find_cell_runs(Model<2>&, bool);
template void find_cell_runs(Model<3>&, bool);
template void shrink_soil(Model<2>&);
template void shrink_soil(Model<3>&);
} // namespace mpm
