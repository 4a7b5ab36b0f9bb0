#include "explicit/explicit_step.h"

#include "explicit/dashpots.h"
#include "explicit/momentum.h"
#include "explicit/particle_update.h"
#include "explicit/two_phase_step.h"
#include "materials/laws/association.h"
#include "model/absorbing.h"
#include "model/contacts.h"
#include "model/far_field.h"
#include "model/field_contact_work.h"
#include "model/field_contacts.h"
#include "model/integration.h"
#include "model/mapping.h"
#include "model/material_points.h"
#include "model/members.h"
#include "model/pressure_relaxation.h"
#include "model/reproducible.h"
#include "model/resting_nodes.h"

#include <algorithm>
#include <cmath>

namespace mpm::explicit_scheme
{
namespace
{
/// What the velocity of a field gives to the strains beside the gradients of the cells: means over the cells around the
/// nodes, where the run asks for them.
/// @note Collective where it does
template <class G>
void find_means(Model<G>& model, const ExplicitOptions& options, double dt, VelocityField<G>& field)
{
  if (options.nmd)
  {
    average_strains(model.mesh, model.exchange, field.velocity, dt, field);
    relax_pressures(model, dt, field);
  }
  if (options.integration == Integration::dual_domain)
    average_gradients(model.mesh, model.exchange, field);
}

/// Adds forces at the nodes beside those of gravity and stresses: of rigid surfaces, of damping, of absorbing sides.
/// @note Collective
template <class G>
void add_nodal_forces(Model<G>& model, const ExplicitOptions& options, double dt, VelocityField<G>& field)
{
  add_contact_forces(model, dt, field);
  add_member_forces(model, field);
  add_rayleigh_forces(model, options.rayleigh, field);
  add_forces_of_ground(model.mesh, gravity_at(model, model.time), model.time, dt, field);
}

/// The step of the paper: stresses last, with the velocities of the moved particles (MUSL).
template <class G>
void modified_update_stress_last(Model<G>& model, const ExplicitOptions& options, double dt)
{
  PhaseClock clock(model.phase_seconds);
  const auto gravity = gravity_at(model, model.time);
  const auto& mesh = model.mesh;
  NodeExchange& exchange = model.exchange;
  const bool affine = options.transfer == Transfer::affine; // PIC then takes from the gradients that particles carry
  const double replaced = affine ? 0 : options.pic_fraction;
  for (VelocityField<G>& field : model.fields)
  {
    // Particles to nodes: m_i (11), momentum, f_int,i (14) and tractions (15)
    clock.begin(Phase::node_sums);
    particles_to_nodes(mesh, exchange, model.particles, model.order.runs, field);
    sum_shared(exchange, field.nodes);
    find_start_velocity(field);
    add_nodal_forces(model, options, dt, field);
  }
  add_field_contact_forces(model, gravity, dt);
  for (VelocityField<G>& field : model.fields)
  {
    // Momentum balance: a_i = (f_ext - f_int - D)_i / m_i
    clock.begin(Phase::momentum);
    find_acceleration(gravity, options.damping, dt, field);
    // The second mapping, m_i v_i = sum m_p N_i v_p (19) with v_p from (18), comes before (18) here: sum m_p N_i dt
    // a(x_p) follows from the moments of the cells, so that the particles are visited once, for (18) and (20) together.
    clock.begin(Phase::mapping);
    find_velocity_change(field, replaced, dt);
    if (options.has_dashpots)
    {
      if (options.renews_dashpots)
        prepare_dashpots(model);
      add_dashpots(model, replaced, dt, field);
      find_velocity_change(field, replaced, dt);
    }
    scatter_momentum<G>(mesh, exchange, part_of_particles(field), field.moments, field.velocity_change, field.velocity);
    gain_resting_momentum<G>(model, replaced, field, field.velocity);
    sum_shared(exchange, field.velocity);
    find_mapped_velocity(1 - replaced, field);
    keep_driven_velocity<G>(field.dashpots, dt, field);
  }
  separate_fields(model, dt);
  for (VelocityField<G>& field : model.fields)
  {
    clock.begin(Phase::momentum);
    add_work(field, exchange.owned, gravity, options.damping, dt, model.totals);
    if (affine)
      add_transfer_work(field, exchange.owned, dt, model.energy);
    note_rayleigh_work(exchange.owned, dt, field, model.totals);
    clock.begin(Phase::averaging);
    find_means(model, options, dt, field);
  }
  note_field_contact_work(model, dt);
  update_particles(model, options, dt, true, clock); // (18), (20), stresses; migration
}

/// Stresses last, with v_i + dt a_i (USL).
template <class G>
void update_stress_last(Model<G>& model, const ExplicitOptions& options, double dt)
{
  PhaseClock clock(model.phase_seconds);
  const auto gravity = gravity_at(model, model.time);
  for (VelocityField<G>& field : model.fields)
  {
    clock.begin(Phase::node_sums);
    particles_to_nodes(model.mesh, model.exchange, model.particles, model.order.runs, field);
    sum_shared(model.exchange, field.nodes);
    find_start_velocity(field);
    add_nodal_forces(model, options, dt, field);
  }
  add_field_contact_forces(model, gravity, dt);
  for (VelocityField<G>& field : model.fields)
  {
    clock.begin(Phase::momentum);
    find_acceleration(gravity, options.damping, dt, field);
    if (options.has_dashpots)
    {
      find_advanced_velocity(dt, field);
      add_dashpot_forces(model.mesh, model.time, dt, false, field);
    }
    find_velocity_change(field, options.pic_fraction, dt);
    find_advanced_velocity(dt, field);
    add_work(field, model.exchange.owned, gravity, options.damping, dt, model.totals);
    note_rayleigh_work(model.exchange.owned, dt, field, model.totals);
    clock.begin(Phase::averaging);
    find_means(model, options, dt, field);
  }
  note_field_contact_work(model, dt);
  update_particles(model, options, dt, true, clock);
}

/// Stresses first, with the velocities at the step's start (USF).
template <class G>
void update_stress_first(Model<G>& model, const ExplicitOptions& options, double dt)
{
  PhaseClock clock(model.phase_seconds);
  const auto gravity = gravity_at(model, model.time);
  clock.begin(Phase::node_sums);
  map_to_nodes(model);
  for (VelocityField<G>& field : model.fields)
  {
    find_start_velocity(field);
    field.velocity = field.start_velocity;
  }
  separate_fields(model, dt); // by the contacts of the step before
  note_late_work(model);
  for (VelocityField<G>& field : model.fields)
    find_means(model, options, dt, field);
  clock.begin(Phase::particles);
  particle_pass(model, {dt, false, true, 0, options.nmd, dt});
  clock.begin(Phase::node_sums);
  map_to_nodes(model); // the stresses have changed
  clock.begin(Phase::momentum);
  double work_at_end = 0;
  for (VelocityField<G>& field : model.fields)
    add_nodal_forces(model, options, dt, field);
  add_field_contact_forces(model, gravity, dt);
  for (VelocityField<G>& field : model.fields)
  {
    find_acceleration(gravity, options.damping, dt, field);
    find_velocity_change(field, options.pic_fraction, dt);
    find_advanced_velocity(dt, field);
    work_at_end += add_work(field, model.exchange.owned, gravity, options.damping, dt, model.totals);
    note_rayleigh_work(model.exchange.owned, dt, field, model.totals);
  }
  note_field_contact_work(model, dt, true);
  model.energy.ahead = -0.5 * work_at_end; // the stresses are half a step behind the velocities, not ahead
  update_particles(model, options, dt, false, clock);
}
} // namespace

namespace
{
template <class G>
void take_step(Model<G>& model, const ExplicitOptions& options, double dt)
{
  if (has_two_phases(model))
    return two_phase_step(model, options, dt);
  switch (options.stress_update)
  {
  case StressUpdate::modified_last:
    return modified_update_stress_last(model, options, dt);
  case StressUpdate::last:
    return update_stress_last(model, options, dt);
  case StressUpdate::first:
    return update_stress_first(model, options, dt);
  }
}
} // namespace

template <class G>
void choose_forces(Model<G>& model, Integration kind, Averages averages)
{
  // Elements with water average as steps do. Beside water that moves by itself the soil averages as elements do: its
  // volume is that of its pores, whose growth is averaged in full, so that it would lock by half; and forces that are
  // averaged in full do not feel effective stresses that alternate from cell to cell, in which drained soil creeps.
  const bool in_full = has_two_phases(model) || (averages == Averages::as_elements && !model.water);
  for (VelocityField<G>& field : model.fields)
  {
    field.integration.kind = kind;
    field.integration.averaged_by_law.clear();
    field.integration.averaged_of_cell.clear();
    field.integration.strains_in_full = in_full;
    if (averages == Averages::none)
      continue;
    for (const Law& law : model.laws)
      field.integration.averaged_by_law.push_back(in_full ? fraction_of_averaged_forces(law)
                                                          : fraction_of_averages(law));
  }
}

template <class G>
void explicit_step(Model<G>& model, const ExplicitOptions& options, double dt)
{
  choose_forces(model, options.integration, options.nmd ? Averages::of_steps : Averages::none);
  choose_groups(model, options.nmd);
  model.exchange.reproducible = options.reproducible;
  if (options.reproducible)
    sum_rounded_moments(model);
  model.last.dt = dt;
  begin_contacts(model, {model.time, dt});
  take_step(model, options, dt);
  if (model.failure)
    return;
  end_contacts(model, {model.time, dt});
  move_members(model, dt);
  const VelocityField<G>* water = has_two_phases(model) ? &model.water_field.motion : nullptr;
  for (VelocityField<G>& field : model.fields)
    move_springs(model.mesh, model.time + 0.5 * dt, dt, field, water);
  model.time += dt;
  ++model.totals.steps;
  model.totals.particle_steps += model.particles.size();
}

namespace
{
/// Adds squares of f_ext - f_int over unsupported directions, of f_ext, and of reactions.
/// @param sums_of  nodal sums of soil and water together; a callable Index -> NodeSums
template <class G, class SumsOf>
void add_squares(const VelocityField<G>& field, SumsOf&& sums_of, std::span<const unsigned char> owned,
                 const Vector<G::dim>& gravity, std::array<double, 3>& squares)
{
  constexpr int D = G::dim;
  auto support = field.supports.begin();
  for (std::size_t i = 0; i < field.nodes.size(); ++i)
  {
    while (support != field.supports.end() && support->node < static_cast<Index>(i))
      ++support;
    const NodeSums<D> node = sums_of(i);
    if (!owned[i] || is_light(field, static_cast<Index>(i)))
      continue;
    const Vector<D> external = external_force<D>(node, gravity);
    Vector<D> unbalanced = unbalanced_force<D>(node, gravity);
    if (support != field.supports.end() && support->node == static_cast<Index>(i))
    {
      Support<D> held = *support;
      held.value.fill(0);
      squares[2] += dot<D>(unbalanced, unbalanced);
      impose<D>(held, unbalanced);
      squares[2] -= dot<D>(unbalanced, unbalanced);
    }
    squares[0] += dot<D>(unbalanced, unbalanced);
    squares[1] += dot<D>(external, external);
  }
}
} // namespace

namespace
{
/// Sums of soil and water together.
template <class G>
NodeSums<G::dim> sums_of_phases(const Model<G>& model, std::size_t i)
{
  NodeSums<G::dim> sums = model.fields.front().nodes[i];
  const NodeSums<G::dim>& water = model.water_field.motion.nodes[i];
  sums.mass += water.mass;
  for (int a = 0; a < G::dim; ++a)
    sums.internal[a] += water.internal[a];
  return sums;
}
} // namespace

template <class G>
double out_of_balance(const Model<G>& model, const Vector<G::dim>& gravity)
{
  std::array<double, 3> squares{};
  for (const VelocityField<G>& field : model.fields)
  {
    std::vector<Vector<G::dim>> beyond(field.nodes.size());
    add_far_field_forces<G::dim>(field.far_field, gravity, beyond);
    const auto sums_of = [&](std::size_t i)
    {
      NodeSums<G::dim> node = has_two_phases(model) ? sums_of_phases(model, i) : field.nodes[i];
      for (int a = 0; a < G::dim; ++a)
        node.traction[a] += beyond[i][a];
      return node;
    };
    add_squares(field, sums_of, model.exchange.owned, gravity, squares);
  }
  MPI_Allreduce(MPI_IN_PLACE, squares.data(), 3, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  const double acting = squares[1] > 0 ? squares[1] : squares[2];
  return acting > 0 ? std::sqrt(squares[0] / acting) : 0;
}

double pic_fraction_of_step(double fraction, double dt, double critical)
{
  return fraction == 0 ? 0 : -std::expm1(dt / critical * std::log1p(-fraction)); // 1 for a fraction of 1
}

#define INSTANTIATE(G)                                                                                                 \
  template void choose_forces(Model<G>&, Integration, Averages);                                                       \
  template void explicit_step(Model<G>&, const ExplicitOptions&, double);                                              \
  template double out_of_balance(const Model<G>&, const Vector<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
