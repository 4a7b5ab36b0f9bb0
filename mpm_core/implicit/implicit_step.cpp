#include "implicit/implicit_step.h"

#include "explicit/critical_step.h"
#include "explicit/explicit_step.h"
#include "implicit/averaging.h"
#include "implicit/balance.h"
#include "implicit/contact_force.h"
#include "implicit/driven_bodies.h"
#include "implicit/external_force.h"
#include "implicit/far_field.h"
#include "implicit/ghost.h"
#include "implicit/inertia.h"
#include "implicit/internal_force.h"
#include "implicit/pore_drying.h"
#include "implicit/pore_preparation.h"
#include "implicit/pore_update.h"
#include "implicit/pore_water.h"
#include "implicit/preparation.h"
#include "implicit/stages.h"
#include "implicit/supported.h"
#include "implicit/trial.h"
#include "model/affine.h"
#include "model/cell_change.h"
#include "model/far_field.h"
#include "model/mapping.h"
#include "model/moving_cells.h"
#include "model/particle_pass.h"
#include "model/resting_nodes.h"

#include <algorithm>
#include <utility>

namespace mpm::implicit
{
namespace
{
explicit_scheme::Averages averages_of(const ImplicitOptions& options)
{
  using enum explicit_scheme::Averages;
  if (!options.average_stress)
    return none;
  return options.as_elements ? as_elements : of_steps;
}
} // namespace

// --- Start: v0, and the first iterate (I1)

template <class G>
void start_step(Model<G>& model, ImplicitStep<G>& step, const ImplicitOptions& options, double dt)
{
  if (model.fields.size() > 1)
    throw InputError("the model has " + std::to_string(model.fields.size()) +
                     " velocity fields, expected one in implicit steps");
  reset_cells(model);
  begin_transfer(model, Transfer::flip);
  prepare(model);
  model.exchange.reproducible = false; // an explicit run before may have asked for it
  VelocityField<G>& field = model.fields.front();
  step.runs = model.order.runs;
  step.runs.insert(step.runs.end(), field.resting.runs.begin(), field.resting.runs.end());
  const auto points = points_of(model, step);
  step.options = options;
  step.time = model.time;
  step.length = dt;
  stand_water(model, model.time + dt, gravity_at(model, model.time + dt));
  step.has_contacts = !model.contacts.empty();
  explicit_scheme::choose_forces(model, options.integration, averages_of(options));
  choose_groups(model, options.nmd);
  map_to_nodes(model); // (11), (15)
  find_start_velocity(field);
  find_start_of_light_nodes(model.mesh, model.exchange, field);
  field.has_light_nodes = false; // the equations give them velocities, too
  if (options.quasi_static)
    std::ranges::fill(field.start_velocity, Vector<G::dim>{});
  make_halos_once(model.mesh, model.exchange, step);
  update(step.halos.nodes, field.start_velocity);
  find_active(model.mesh, model.exchange, field, step);
  find_frequencies(model.mesh, model.exchange, points, field, step);
  step.ghosts = find_ghost_facets<G>(model, points, step.halos.cells, options.ghost, options.quasi_static);
  field.velocity = field.start_velocity;
  impose_supports(step, field);
  begin_first_stage(field, step);
  start_contacts(model, step);
  start_bodies(model, step);
  start_pore_water(model, step);
  step.forces.assign(field.nodes.size(), {});
  step.external = external_forces(field, gravity_at(model, model.time + step.dt), step.options.load_fraction);
}

template <class G>
void start_second_stage(Model<G>& model, ImplicitStep<G>& step)
{
  VelocityField<G>& field = model.fields.front();
  keep_contact_forces(step);
  begin_second_stage(field, step);
  impose_supports(step, field);
  step.external = external_forces(field, gravity_at(model, model.time + step.dt), step.options.load_fraction);
}

// --- Trial and residual: r = f_ext - f_int(u) - ghost penalty - inertia (I2), (I3)

template <class G>
TrialReport find_residual(Model<G>& model, ImplicitStep<G>& step, bool tangents)
{
  const auto& mesh = model.mesh;
  NodeExchange& exchange = model.exchange;
  VelocityField<G>& field = model.fields.front();
  // Trial: stresses under u = dt v, from the step's start (I2)
  update(step.halos.nodes, field.velocity);
  if (step.options.nmd)
    average_strains(mesh, exchange, field.velocity, step.dt, field); // (T6)
  const auto count = try_stresses(mesh, points_of(model, step), field, tangents, step);
  if (step.options.average_stress)
    average_stresses<G>(mesh, exchange, field, step.stress);
  if (step.pore.flows)
    update(step.halos.nodes, step.pore.rate);
  if (model.water && model.water->may_dry())
    try_drying(mesh, model.particles, step.runs, field, *model.water, step);
  try_contacts(model, tangents, step);
  balance_bodies(model, tangents, step);
  // Residual: each term adds its forces at the nodes, this rank's part (I3)
  step.forces.assign(field.nodes.size(), {});
  add_external_forces(step, exchange.owned, step.forces);
  add_contact_forces(step, step.forces);
  add_border_forces(exchange, field, step, step.forces);
  add_internal_forces(mesh, step, step.forces);
  add_pore_forces(mesh, step, step.forces);
  add_ghost_forces(field, step, step.forces);
  add_inertia_forces(field, step, exchange.owned, step.forces);
  sum_shared(exchange, step.forces);
  balance(field, step);
  find_water_balance(mesh, exchange, field, step); // (W2)

  for (std::size_t i = 0; i < step.forces.size(); ++i)
    field.nodes[i].internal = step.forces[i].internal;
  model.last.plastic = count.plastic;
  TrialReport report = trial_report(exchange, field, step, count);
  add_bodies(step, report);
  step.failure = report.failed > 0 ? shared_failure(exchange, count.failure) : std::nullopt;
  return report;
}

// --- Tangent: J = -dr/du (I4)

template <class G, int D>
void find_tangent(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                  const ImplicitSystem<D>& system, TangentEntries& tangent)
{
  TangentSum<D> stiffness(system, tangent.stiffness);
  add_internal_entries(mesh, step, stiffness);
  add_contact_entries(mesh, step, stiffness);
  add_ghost_entries(step, stiffness);
  add_inertia_entries(field, step, system.owned, stiffness);
  add_border_entries(field.far_field, system, stiffness);
  add_support_entries(system, stiffness);
  add_pore_entries(mesh, field, step, stiffness);
  if (!step.options.nmd)
    return;
  volumetric_force_entries(mesh, step, system, tangent.volumetric_force);
  volumetric_strain_entries(mesh, field, system, tangent.volumetric_strain);
  if (step.options.average_stress)
    mean_stress_entries(mesh, step, system, tangent.mean_stress, tangent.mean_stress_by_strain);
}

// --- Accept: the particles follow the nodes (I5)

namespace
{
/// PIC fraction of the step. Quasi-static: with grid velocities of zero it leaves the particles at rest.
/// @note Collective
template <class G>
double pic_fraction(const Model<G>& model, const ImplicitStep<G>& step)
{
  if (step.options.quasi_static)
    return 1;
  if (step.options.pic == 0)
    return 0;
  const double critical = critical_time_step(model);
  return pic_fraction_of_step(step.options.pic, step.dt, critical);
}

/// Makes the particles and their energies those of the step's start again.
template <class G>
void undo(Model<G>& model, const Particles<G::dim>& start, const EnergyBook& energy)
{
  model.particles = start;
  model.energy = energy;
  model.migration.migrating.clear();
  model.migration.outflow.clear();
  model.migration.far_partners.clear();
  model.ready = false;
}

/// Gives nodes the sums of the particles as they are now, so that the out-of-balance ratio is theirs. Nodes that the
/// soil has just left keep the velocities of this step until the next one.
/// @note Collective
template <class G>
void map_to_nodes_again(Model<G>& model, const ImplicitStep<G>& step)
{
  VelocityField<G>& field = model.fields.front();
  const bool shrinks = std::exchange(field.part_shrinks, false);
  map_to_nodes(model);
  add_contact_tractions(model, step);
  field.part_shrinks = shrinks;
}
} // namespace

template <class G>
bool accept_step(Model<G>& model, const ImplicitStep<G>& step)
{
  const ImplicitOptions& options = step.options;
  VelocityField<G>& field = model.fields.front();
  if (options.nmd)
    average_strains(model.mesh, model.exchange, field.velocity, step.dt, field);
  find_acceleration(step, field);
  const double pic = pic_fraction(model, step);
  find_velocity_change(field, pic, step.dt);
  const auto start = model.particles;
  const EnergyBook energy = model.energy;
  update_pore_water(model, step);
  keep_slip(model, step);
  particle_pass(model,
                {step.dt, !options.hold_positions, true, pic, options.nmd, law_dt(step), options.hold_positions,
                 Transfer::flip, false, options.hold_positions && options.count_displacement}); // (18), (20), stresses
  agree_on_failure(model);
  if (model.failure)
  {
    undo(model, start, energy);
    return false;
  }
  add_work(field, step, model.exchange.owned, model.totals);
  move_border(model.exchange, step.dt, field);
  move_bodies(model, step);
  if (model.water)
    add_flow(model.mesh, field, step, model.exchange.owned, *model.water, model.totals);
  model.last.dt = step.dt;
  model.energy.ahead = 0; // velocities and stresses are of one time
  migrate_particles(model);
  update_resting_rows(model);
  if (step.pore.flows && changes_masses(*model.water, options))
    take_masses(model);
  make_resting_cells(model.mesh, model.particles, field);
  model.time += step.dt;
  ++model.totals.steps;
  model.totals.particle_steps += model.particles.size();
  const bool books = step.pore.flows && !model.water->may_dry(); // the energy of suction has no account
  if (options.quasi_static && !books) // what the loads do beyond the stresses' work goes nowhere
    start_energy_balance(model);
  map_to_nodes_again(model, step);
  return true;
}

#define INSTANTIATE(G)                                                                                                 \
  template void start_step(Model<G>&, ImplicitStep<G>&, const ImplicitOptions&, double);                               \
  template void start_second_stage(Model<G>&, ImplicitStep<G>&);                                                       \
  template TrialReport find_residual(Model<G>&, ImplicitStep<G>&, bool);                                               \
  template void find_tangent(const Mesh<G::dim>&, const VelocityField<G>&, const ImplicitStep<G>&,                     \
                             const ImplicitSystem<G::dim>&, TangentEntries&);                                          \
  template bool accept_step(Model<G>&, const ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
