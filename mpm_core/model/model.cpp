#include "model/model.h"

#include "base/number_text.h"
#include "model/affine.h"
#include "model/integration.h"
#include "model/mapping.h"
#include "model/resting_nodes.h"
#include "parallel/agreement.h"
#include "transfer/affine_momentum.h"
#include "transfer/resting.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::model
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
                                         " is " + number_text(static_cast<double>(column[p])) +
                                         ", expected a finite number");
                  });
  for (std::size_t p = 0; p < particles.id.size(); ++p)
    if (!(particles.mass[p] > 0 && particles.volume[p] > 0))
      throw InputError("mass and volume of particle " + std::to_string(particles.id[p]) + " are " +
                       number_text(particles.mass[p]) + " and " + number_text(particles.volume[p]) +
                       ", expected positive numbers");
}
} // namespace

template <class G>
void set_laws(Model<G>& model, std::vector<Law> laws, std::vector<Index> field_of_law)
{
  if (field_of_law.empty())
    field_of_law.assign(laws.size(), 0);
  if (field_of_law.size() != laws.size())
    throw InputError("velocity_fields has " + std::to_string(field_of_law.size()) +
                     " numbers, expected one for each of " + std::to_string(laws.size()) + " laws");
  const Index most = *std::ranges::max_element(field_of_law);
  for (Index field = 0; field <= most; ++field)
    if (std::ranges::count(field_of_law, field) == 0 || *std::ranges::min_element(field_of_law) < 0)
      throw InputError("velocity_fields has no law in the field " + std::to_string(field) +
                       ", expected numbers from 0 without gaps");
  int states = 0;
  for (const Law& law : laws)
  {
    states = std::max(states, n_state(law));
    if (G::has_hoop && needs(law).deformation)
      throw InputError("the law " + law_name(law) +
                       " needs deformation gradients, which it is not given in axial symmetry");
  }
  model.particles.state.resize(static_cast<std::size_t>(states));
  model.laws = std::move(laws);
  model.field_of_law = std::move(field_of_law);
  model.fields.resize(static_cast<std::size_t>(most) + 1);
  group_soils(model);
}

template <class G>
void sort_particles(Model<G>& model)
{
  sort_by_cell(model.particles, model.mesh.owned_cells, static_cast<Index>(model.laws.size()));
  find_cell_runs(model, false);
  for (VelocityField<G>& field : model.fields)
    field.part_shrinks = true;
  model.order.out_of_order = 0;
  model.order.cost = 0;
  ++model.totals.sorts;
}

namespace
{
/// Marks the first run of a field in each cell, and empties the cells that its last particle has left.
template <class G>
void find_first_runs(Model<G>& model, VelocityField<G>& field)
{
  auto& marks = model.order.marks;
  for (Run& run : model.order.runs)
    if (&field_of(model, run.material) == &field)
    {
      run.first_in_cell = !marks[run.cell];
      marks[run.cell] = 1;
    }
  for (Index c : field.left)
    if (!marks[c])
    {
      field.moments[c] = {};
      if (!field.tractions.empty())
        field.tractions[c] = {};
    }
  field.left.clear();
  for (const Run& run : model.order.runs)
    marks[run.cell] = 0;
}
} // namespace

template <class G>
void find_cell_runs(Model<G>& model, bool again)
{
  CellOrder& order = model.order;
  if (again)
    find_runs_again(model.particles, batch_size, order.runs);
  else
  {
    find_runs(model.particles, batch_size, order.runs);
    if (model.particles.resting.present)
      take_resting_runs(model.mesh, order.runs, model.fields.front());
  }
  order.marks.resize(model.mesh.cells.size(), 0);
  for (VelocityField<G>& field : model.fields)
    find_first_runs(model, field);
}

template <class G>
Inventory taken_inventory(const Model<G>& model)
{
  const std::int64_t particles =
      model.particles.size() + model.totals.outflow_particles - model.totals.gained_particles;
  std::array<double, 2> sums{static_cast<double>(particles), model.totals.outflow_mass};
  for (double mass : model.particles.mass)
    sums[1] += mass;
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  return {sums[0], sums[1]};
}

namespace
{
/// Nodes and cells of a field at rest and empty, as many as the mesh has.
template <class G>
void clear_field(const Mesh<G::dim>& mesh, bool loaded, VelocityField<G>& field)
{
  const auto nodes = mesh.points.size(), cells = static_cast<std::size_t>(mesh.owned_cells);
  field.nodes.assign(nodes, {});
  for (auto* values : {&field.start_velocity, &field.acceleration, &field.velocity_change, &field.velocity})
    values->assign(nodes, {});
  field.part = {};
  field.resting = {};
  field.left.clear();
  field.moments.assign(cells, CellMoments<G>{});
  field.tractions.assign(loaded ? cells : 0, TractionMoments<G::dim>{});
}

/// The masses below which nodes are light: a fraction of that of the lightest particle, so that nodes of light
/// particles beside heavy ones move, but not below the round-off of the heaviest.
///
/// A particle at the distance N h from the facet opposite to a node gives it the mass N m, and its second moment about
/// the facet is N^2 h^2 m. Moments have a round-off of eps |x| h m, since positions have one of eps |x|. Below
/// N = sqrt(eps |x| / h) the momentum that a change of the node's velocity adds is round-off, and grows from step to
/// step.
/// @note Collective
template <class G>
void find_least_masses(Model<G>& model)
{
  constexpr double infinite = std::numeric_limits<double>::infinity();
  std::vector<double> values(2 * model.fields.size() + 1, -infinite); // -lightest and heaviest of each field, fraction
  for (Index p = 0; p < model.particles.size(); ++p)
  {
    const auto k = static_cast<std::size_t>(&field_of(model, model.particles.material[p]) - model.fields.data());
    values[2 * k] = std::max(values[2 * k], -model.particles.mass[p]);
    values[2 * k + 1] = std::max(values[2 * k + 1], model.particles.mass[p]);
  }
  values.back() = std::sqrt(model.mesh.round_off);
  MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_MAX, model.exchange.comm);
  for (std::size_t k = 0; k < model.fields.size(); ++k)
    model.fields[k].least_mass =
        values[2 * k + 1] > 0 ? std::max(-values.back() * values[2 * k], 1e-12 * values[2 * k + 1]) : 0;
}
} // namespace

namespace
{
/// @throws InputError where a cell holds a row beside that of the resting cell
template <int D>
void check_resting_cells(const Particles<D>& particles, const std::vector<Run>& runs, const RestingCells<D>& resting)
{
  const auto refuse = [&](Index p)
  {
    throw InputError("particle " + std::to_string(particles.id[p]) +
                     " is in a resting cell, expected resting cells without particles");
  };
  for (const Run& run : runs)
    if (!resting.marks.empty() && resting.marks[static_cast<std::size_t>(run.cell)])
      refuse(run.first);
  for (std::size_t r = 1; r < resting.runs.size(); ++r)
    if (resting.runs[r].cell == resting.runs[r - 1].cell)
      refuse(resting.runs[r].first);
}

/// The moments of all cells from their particles.
template <class G, int D = G::dim>
void sum_moments(Model<G>& model)
{
  Rules<D> rules;
  const Particles<D>& particles = model.particles;
  for (const Run& run : model.order.runs)
  {
    VelocityField<G>& field = field_of(model, run.material);
    const auto& shape = model.mesh.shapes[run.cell];
    add_moments<G>(particles, run.first, run.last, shape, field.moments[run.cell]);
    add_affine_momentum(model.mesh, particles, run.first, run.last, run.cell, field.moments[run.cell]);
    if (!field.tractions.empty())
      add_moments(particles, run.first, run.last, shape, field.tractions[run.cell]);
  }
  VelocityField<G>& field = model.fields.front();
  for (const Run& run : field.resting.runs)
  {
    CellMoments<G>& moments = field.moments[run.cell];
    const Rule<D>& rule = rule_of<D>(static_cast<int>(particles.resting[0][run.first]), rules);
    take_mass(model.mesh, run.cell, particles.mass[run.first], rule, moments);
    take_row<G>(particles, run.first, moments);
  }
}
} // namespace

template <class G>
void prepare(Model<G>& model)
{
  if (model.ready)
    return;
  collectively(model.exchange.comm, [&] { check_particles(model.particles); });
  agree_on_fields(model.particles, model.exchange.comm);
  const bool loaded = model.particles.traction.present;
  for (VelocityField<G>& field : model.fields)
    clear_field(model.mesh, loaded, field);
  model.migration.owned_cells = owned_cell_numbers(model.mesh);
  sort_particles(model);
  collectively(model.exchange.comm,
               [&] { check_resting_cells(model.particles, model.order.runs, model.fields.front().resting); });
  sum_moments(model);
  make_resting_cells(model.mesh, model.particles, model.fields.front());
  find_least_masses(model);
  model.inventory = taken_inventory(model);
  model.ready = true;

  stand_water(model, model.time, gravity_at(model, model.time));
  map_to_nodes(model); // what nodes are at the start may be looked at before a step
  for (VelocityField<G>& field : model.fields)
  {
    find_start_velocity(field);
    field.velocity = field.start_velocity;
  }
  if (has_affine_gradients(model.particles))
    model.energy.kinetic = affine_kinetic_energy(model);
  if (model.energy.stale)
  {
    start_energy_balance(model);
    start_plastic_work(model);
  }
}

template <class G>
void take_masses(Model<G>& model)
{
  for (const std::vector<Run>* runs : {&model.order.runs, &model.fields.front().resting.runs})
    for (const Run& run : *runs)
    {
      VelocityField<G>& field = field_of(model, run.material);
      field.moments[run.cell] = {};
      if (!field.tractions.empty())
        field.tractions[run.cell] = {};
    }
  sum_moments(model);
  find_least_masses(model);
  model.inventory = taken_inventory(model);
}

#define INSTANTIATE(G)                                                                                                 \
  template void set_laws(Model<G>&, std::vector<Law>, std::vector<Index>);                                             \
  template void prepare(Model<G>&);                                                                                    \
  template void take_masses(Model<G>&);                                                                                \
  template Inventory taken_inventory(const Model<G>&);                                                                 \
  template void sort_particles(Model<G>&);                                                                             \
  template void find_cell_runs(Model<G>&, bool);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
