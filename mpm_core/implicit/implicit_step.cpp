#include "implicit/implicit_step.h"

#include "explicit/explicit_step.h"
#include "implicit/trial.h"
#include "model/mapping.h"
#include "model/particle_pass.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mpm
{
namespace
{
/// Nodes that a filled cell touches: those that the step moves. A node may have stiffness and yet hardly any mass.
template <class G, int D = G::dim>
void find_active(Model<G>& model, ImplicitStep<G>& step)
{
  std::vector<double> filled(model.mesh.points.size(), 0.0);
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    if (model.fields.front().moments[c].volume > 0)
      for (Index node : model.mesh.cells[c])
        filled[node] = 1;
  sum_shared(model.exchange, filled.data(), 1);
  step.active.resize(filled.size());
  std::transform(filled.begin(), filled.end(), step.active.begin(), [](double f) { return f > 0 ? 1 : 0; });
}

/// Forces of the ghost penalty for the iterate.
template <class G, int D = G::dim>
void add_ghost_forces(Model<G>& model, ImplicitStep<G>& step)
{
  const VelocityField<G>& field = model.fields.front();
  const double inertia = step.options.quasi_static ? 0 : 1 / step.stage.dt;
  for (const GhostFacet<D>& facet : step.ghosts)
  {
    const Vector<D> jump =
        jump_over(facet,
                  [&](Index i)
                  {
                    Vector<D> value;
                    for (int a = 0; a < D; ++a)
                      value[a] = facet.stiffness * step.dt * (field.velocity[i][a] - field.start_velocity[i][a]) +
                                 facet.mass * inertia * (end_velocity(model, step, i, a) - step.stage.start[i][a]);
                    return value;
                  });
    for (int k = 0; k < D + 2; ++k)
      for (int a = 0; a < D; ++a)
        step.forces[facet.nodes[k]].ghost[a] += facet.share[k] * facet.jump[k] * jump[a];
  }
}

/// Forces of the trial's stresses (14) and of the ghost penalty, at the nodes.
template <class G, int D = G::dim>
void find_forces(Model<G>& model, ImplicitStep<G>& step)
{
  step.forces.assign(model.mesh.points.size(), {});
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    if (model.fields.front().moments[c].volume == 0)
      continue;
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> force = internal_force<G>(step.stress[c], model.mesh.shapes[c], k);
      for (int a = 0; a < D; ++a)
        step.forces[model.mesh.cells[c][k]].internal[a] += force[a];
    }
  }
  add_ghost_forces(model, step);
  sum_shared(model.exchange, step.forces);
  for (std::size_t i = 0; i < step.forces.size(); ++i)
    model.fields.front().nodes[i].internal = step.forces[i].internal;
}

/// Forces on a node, means over the stages so far, by their weights.
template <class G, int D = G::dim>
MeanForces<D> mean_forces(const Model<G>& model, const ImplicitStep<G>& step, Index node)
{
  MeanForces<D> mean = step.stage.before.empty() ? MeanForces<D>{} : step.stage.before[node];
  const double weight = step.stage.weight;
  for (int a = 0; a < D; ++a)
  {
    mean.external[a] += weight * step.external[node][a];
    mean.internal[a] += weight * step.forces[node].internal[a];
    mean.ghost[a] += weight * step.forces[node].ghost[a];
    mean.inertia[a] += weight * inertia_force(model, step, node, a).force;
  }
  return mean;
}

/// f_ext at the end of the stage.
template <class G, int D = G::dim>
void find_external(const Model<G>& model, ImplicitStep<G>& step)
{
  const VelocityField<G>& field = model.fields.front();
  const Vector<D> gravity = gravity_at(model, model.time + step.dt);
  const double share = step.options.load_share;
  step.external.resize(field.nodes.size());
  for (std::size_t i = 0; i < field.nodes.size(); ++i)
    for (int a = 0; a < D; ++a)
    {
      const double load = field.nodes[i].traction[a] + field.nodes[i].mass * gravity[a];
      step.external[i][a] =
          share == 1 ? load : field.nodes[i].internal[a] + share * (load - field.nodes[i].internal[a]);
    }
}

/// Work done in the step: forces act at its end, or at the ends of its stages, over its whole displacement. That of the
/// ghost penalty counts as damping.
template <class G, int D = G::dim>
void tally(Model<G>& model, const ImplicitStep<G>& step)
{
  const VelocityField<G>& field = model.fields.front();
  Totals& totals = model.totals;
  model.last.dt = step.dt;
  for (std::size_t i = 0; i < field.nodes.size(); ++i)
  {
    if (!model.exchange.owned[i])
      continue;
    for (int a = 0; a < D; ++a)
    {
      const double u = step.dt * field.velocity[i][a];
      const MeanForces<D> mean = mean_forces(model, step, static_cast<Index>(i));
      const double unbalanced = mean.external[a] - mean.internal[a];
      const double inertia = field.nodes[i].mass * field.acceleration[i][a];
      const double reaction = mean.inertia[a] + mean.ghost[a] - unbalanced;
      totals.external_work += mean.external[a] * u;
      totals.internal_work += mean.internal[a] * u;
      totals.support_work += reaction * u;
      totals.damping_work += (unbalanced + reaction - inertia) * u;
    }
  }
}
} // namespace

template <class G, int D>
Inertia stage_inertia(const Model<G>& model, const ImplicitStep<G>& step, Index node, double start, double end)
{
  const double x = step.frequency[node] * step.length;
  const double resolved = step.options.second_order ? left_by_second_order(x) : left_by_backward_euler(x);
  Inertia inertia = damped_inertia(model.fields.front().nodes[node].mass, start, end, step.stage.dt,
                                   step.options.damping, step.frequency[node], resolved);
  inertia.derivative /= step.stage.weight;
  return inertia;
}

template <class G, int D>
Inertia inertia_force(const Model<G>& model, const ImplicitStep<G>& step, Index node, int component)
{
  if (step.options.quasi_static)
    return {0, 0};
  return stage_inertia(model, step, node, step.stage.start[node][component],
                       end_velocity(model, step, node, component));
}

template <class G, int D>
double displacement_error(const Model<G>& model, const ImplicitStep<G>& step)
{
  std::array<double, 2> sums{}; // mass, and mass times the squares
  for (std::size_t i = 0; i < step.stage.carried.size(); ++i)
    for (int a = 0; a < D && model.exchange.owned[i]; ++a)
    {
      const double mass = model.fields.front().nodes[i].mass / D;
      const double first = step.stage.carried[i][a] / (1 - stage_fraction);
      const double error = step.stage.dt * (end_velocity(model, step, static_cast<Index>(i), a) - first);
      sums[0] += mass;
      sums[1] += D * mass * error * error;
    }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  return sums[0] > 0 ? std::sqrt(sums[1] / sums[0]) : 0;
}

template <class G, int D>
void impose_supports(Model<G>& model, const ImplicitStep<G>& step)
{
  for (const Support<D>& support : model.fields.front().supports)
    if (step.active[support.node])
      impose<D>(support, model.fields.front().velocity[support.node]);
}

template <class G, int D>
void start_step(Model<G>& model, ImplicitStep<G>& step, const ImplicitOptions& options, double dt)
{
  if (model.fields.size() > 1)
    throw InputError("the model has " + std::to_string(model.fields.size()) +
                     " velocity fields, expected one in implicit steps");
  prepare(model);
  VelocityField<G>& field = model.fields.front();
  step.options = options;
  step.length = dt;
  step.dt = options.second_order ? stage_fraction * dt : dt;
  field.integration.kind = options.integration;
  map_to_nodes(model); // (11), (15)
  find_start_velocity(field);
  find_active(model, step);
  if (options.damping > 0)
    step.frequency = shear_frequencies(model);
  else
    step.frequency.assign(field.nodes.size(), 0.0);
  if (options.quasi_static)
    std::fill(field.start_velocity.begin(), field.start_velocity.end(), Vector<D>{});
  if (model.exchange.size > 1 && !step.halos_ready)
    step.halos = make_halos(model.mesh, model.exchange.comm);
  step.halos_ready = true;
  update(step.halos.nodes, field.start_velocity);
  step.ghosts = find_ghost_facets(model, step.halos, options.ghost);
  step.stage = {step.dt, 1, field.start_velocity, {}, {}};
  field.velocity = field.start_velocity;
  impose_supports(model, step);

  step.forces.assign(field.nodes.size(), {});
  find_external(model, step);
}

template <class G, int D>
void start_second_stage(Model<G>& model, ImplicitStep<G>& step)
{
  VelocityField<G>& field = model.fields.front();
  const double g = stage_fraction;
  Stage<D> second{g * step.length, g, field.start_velocity, field.velocity, {}};
  second.before.resize(field.nodes.size());
  for (std::size_t i = 0; i < field.nodes.size(); ++i)
  {
    const MeanForces<D> first = mean_forces(model, step, static_cast<Index>(i));
    for (int a = 0; a < D; ++a)
    {
      const double gained = field.velocity[i][a] - field.start_velocity[i][a];
      second.start[i][a] += (1 - g) / g * gained;
      second.carried[i][a] *= 1 - g;
      field.velocity[i][a] += (1 - g) * gained; // as if the acceleration went on, v2 = v0 + (v1 - v0) / g
      second.before[i].external[a] = (1 - g) * first.external[a];
      second.before[i].internal[a] = (1 - g) * first.internal[a];
      second.before[i].ghost[a] = (1 - g) * first.ghost[a];
      second.before[i].inertia[a] = (1 - g) * first.inertia[a];
    }
  }
  step.stage = std::move(second);
  step.dt = step.length;
  find_external(model, step);
  impose_supports(model, step);
}

template <class G, int D>
TrialReport find_residual(Model<G>& model, ImplicitStep<G>& step, bool tangents)
{
  update(step.halos.nodes, model.fields.front().velocity);
  if (step.options.mixed_discretisation)
    average_strains(model.mesh, model.exchange, model.fields.front(), step.dt);
  const TrialCount<D> count = try_stresses(model, step, tangents);
  if (step.options.average_stress)
    average_stresses<G>(model.mesh, model.exchange, model.fields.front(), step.stress);
  find_forces(model, step);

  std::array<double, 6> sums{}; // squares of r, f_ext, f_int, inertia; plastic, failed
  step.residual.assign(step.forces.size(), {});
  for (std::size_t i = 0; i < step.residual.size(); ++i)
    for (int a = 0; a < D && step.active[i]; ++a)
    {
      const double external = step.external[i][a], internal = step.forces[i].internal[a];
      const double inertia = inertia_force(model, step, static_cast<Index>(i), a).force;
      step.residual[i][a] = external - internal - step.forces[i].ghost[a] - inertia;
      if (!model.exchange.owned[i])
        continue;
      sums[1] += external * external;
      sums[2] += internal * internal;
      sums[3] += inertia * inertia;
    }
  for (Support<D> held : model.fields.front().supports)
  {
    held.value.fill(0);
    impose<D>(held, step.residual[held.node]);
  }
  for (std::size_t i = 0; i < step.residual.size(); ++i)
    if (model.exchange.owned[i])
      sums[0] += dot<D>(step.residual[i], step.residual[i]);
  sums[4] = static_cast<double>(count.plastic);
  sums[5] = static_cast<double>(count.failed);
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  model.last.plastic = count.plastic;
  step.failure = sums[5] > 0 ? shared_failure(model.exchange, count.failure) : std::nullopt;
  return {std::sqrt(sums[0]), std::sqrt(std::max({sums[1], sums[2], sums[3]})), static_cast<std::int64_t>(sums[4]),
          static_cast<std::int64_t>(sums[5])};
}

template <class G, int D>
bool finish_step(Model<G>& model, const ImplicitStep<G>& step)
{
  VelocityField<G>& field = model.fields.front();
  const ImplicitOptions& options = step.options;
  for (std::size_t i = 0; i < field.velocity.size(); ++i)
    for (int a = 0; a < D; ++a)
      field.acceleration[i][a] =
          options.quasi_static
              ? 0
              : (end_velocity(model, step, static_cast<Index>(i), a) - field.start_velocity[i][a]) / step.length;
  if (options.mixed_discretisation)
    average_strains(model.mesh, model.exchange, model.fields.front(), step.dt);
  const Particles<D> start = model.particles;
  // Quasi-static: PIC with grid velocities of zero leaves the particles at rest.
  double pic = options.quasi_static ? 1 : 0;
  if (!options.quasi_static && options.pic > 0)
    pic = pic_share_of_step(options.pic, step.dt, critical_time_step(model));
  find_velocity_change(field, pic, step.dt);
  particle_pass(model, {step.dt, !options.hold_positions, true, pic, options.mixed_discretisation, law_dt(step),
                        options.hold_positions}); // (18), (20), stresses
  agree_on_failure(model);
  if (model.failure)
  {
    model.particles = start;
    model.migration.migrating.clear();
    model.migration.outflow.clear();
    model.migration.far_partners.clear();
    model.ready = false;
    return false;
  }
  tally(model, step);
  model.energy.ahead = 0; // velocities and stresses are of one time
  migrate_particles(model);
  model.time += step.dt;
  ++model.totals.steps;
  model.totals.particle_steps += model.particles.size();
  if (options.quasi_static) // without inertia, what the loads do beyond the stresses' work goes nowhere
    start_energy_balance(model);
  // So that the out-of-balance ratio is that of the particles as they are now. Nodes that the soil has just left keep
  // the velocities of this step until the next one.
  const bool shrinks = std::exchange(field.part_shrinks, false);
  map_to_nodes(model);
  field.part_shrinks = shrinks;
  for (std::size_t i = 0; options.average_stress && i < step.forces.size(); ++i)
    field.nodes[i].internal = step.forces[i].internal;
  return true;
}

#define INSTANTIATE(G)                                                                                                 \
  template Inertia inertia_force(const Model<G>&, const ImplicitStep<G>&, Index, int);                                 \
  template Inertia stage_inertia(const Model<G>&, const ImplicitStep<G>&, Index, double, double);                      \
  template double displacement_error(const Model<G>&, const ImplicitStep<G>&);                                         \
  template void impose_supports(Model<G>&, const ImplicitStep<G>&);                                                    \
  template void start_second_stage(Model<G>&, ImplicitStep<G>&);                                                       \
  template void start_step(Model<G>&, ImplicitStep<G>&, const ImplicitOptions&, double);                               \
  template TrialReport find_residual(Model<G>&, ImplicitStep<G>&, bool);                                               \
  template bool finish_step(Model<G>&, const ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm
