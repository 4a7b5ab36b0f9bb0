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
template <int D>
void find_active(Model<D>& model, ImplicitStep<D>& step)
{
  std::vector<double> filled(model.mesh.points.size(), 0.0);
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    if (model.work.moments[c].volume > 0)
      for (Index node : model.mesh.cells[c])
        filled[node] = 1;
  sum_shared(model.exchange, filled.data(), 1);
  step.active.resize(filled.size());
  std::transform(filled.begin(), filled.end(), step.active.begin(), [](double f) { return f > 0 ? 1 : 0; });
}

/// Forces of the ghost penalty for the iterate.
template <int D>
void add_ghost_forces(Model<D>& model, ImplicitStep<D>& step)
{
  const Workspace<D>& work = model.work;
  const double inertia = step.options.quasi_static ? 0 : 1 / step.stage.dt;
  for (const GhostFacet<D>& facet : step.ghosts)
  {
    const Vector<D> jump =
        jump_over(facet,
                  [&](Index i)
                  {
                    Vector<D> value;
                    for (int a = 0; a < D; ++a)
                      value[a] = facet.stiffness * step.dt * (work.velocity[i][a] - work.start_velocity[i][a]) +
                                 facet.mass * inertia * (end_velocity(model, step, i, a) - step.stage.start[i][a]);
                    return value;
                  });
    for (int k = 0; k < D + 2; ++k)
      for (int a = 0; a < D; ++a)
        step.forces[facet.nodes[k]].ghost[a] += facet.share[k] * facet.jump[k] * jump[a];
  }
}

/// Forces of the trial's stresses (14) and of the ghost penalty, at the nodes.
template <int D>
void find_forces(Model<D>& model, ImplicitStep<D>& step)
{
  step.forces.assign(model.mesh.points.size(), {});
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    if (model.work.moments[c].volume == 0)
      continue;
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> force = internal_force<D>(step.stress[c], model.mesh.shapes[c].gradient[k]);
      for (int a = 0; a < D; ++a)
        step.forces[model.mesh.cells[c][k]].internal[a] += force[a];
    }
  }
  add_ghost_forces(model, step);
  sum_shared(model.exchange, step.forces);
  for (std::size_t i = 0; i < step.forces.size(); ++i)
    model.work.nodes[i].internal = step.forces[i].internal;
}

/// Forces on a node, means over the stages so far, by their weights.
template <int D>
MeanForces<D> mean_forces(const Model<D>& model, const ImplicitStep<D>& step, Index node)
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
template <int D>
void find_external(const Model<D>& model, ImplicitStep<D>& step)
{
  const Workspace<D>& work = model.work;
  const Vector<D> gravity = gravity_at(model, model.time + step.dt);
  const double share = step.options.load_share;
  step.external.resize(work.nodes.size());
  for (std::size_t i = 0; i < work.nodes.size(); ++i)
    for (int a = 0; a < D; ++a)
    {
      const double load = work.nodes[i].traction[a] + work.nodes[i].mass * gravity[a];
      step.external[i][a] = share == 1 ? load : work.nodes[i].internal[a] + share * (load - work.nodes[i].internal[a]);
    }
}

/// Work done in the step: forces act at its end, or at the ends of its stages, over its whole displacement. That of the
/// ghost penalty counts as damping.
template <int D>
void tally(Model<D>& model, const ImplicitStep<D>& step)
{
  const Workspace<D>& work = model.work;
  Totals& totals = model.totals;
  model.last.dt = step.dt;
  for (std::size_t i = 0; i < work.nodes.size(); ++i)
  {
    if (!model.exchange.owned[i])
      continue;
    for (int a = 0; a < D; ++a)
    {
      const double u = step.dt * work.velocity[i][a];
      const MeanForces<D> mean = mean_forces(model, step, static_cast<Index>(i));
      const double unbalanced = mean.external[a] - mean.internal[a];
      const double inertia = work.nodes[i].mass * work.acceleration[i][a];
      const double reaction = mean.inertia[a] + mean.ghost[a] - unbalanced;
      totals.external_work += mean.external[a] * u;
      totals.internal_work += mean.internal[a] * u;
      totals.support_work += reaction * u;
      totals.damping_work += (unbalanced + reaction - inertia) * u;
    }
  }
}
} // namespace

template <int D>
Inertia stage_inertia(const Model<D>& model, const ImplicitStep<D>& step, Index node, double start, double end)
{
  const double x = step.frequency[node] * step.length;
  const double resolved = step.options.second_order ? left_by_second_order(x) : left_by_backward_euler(x);
  Inertia inertia = damped_inertia(model.work.nodes[node].mass, start, end, step.stage.dt, step.options.damping,
                                   step.frequency[node], resolved);
  inertia.derivative /= step.stage.weight;
  return inertia;
}

template <int D>
Inertia inertia_force(const Model<D>& model, const ImplicitStep<D>& step, Index node, int component)
{
  if (step.options.quasi_static)
    return {0, 0};
  return stage_inertia(model, step, node, step.stage.start[node][component],
                       end_velocity(model, step, node, component));
}

template <int D>
double displacement_error(const Model<D>& model, const ImplicitStep<D>& step)
{
  std::array<double, 2> sums{}; // mass, and mass times the squares
  for (std::size_t i = 0; i < step.stage.carried.size(); ++i)
    for (int a = 0; a < D && model.exchange.owned[i]; ++a)
    {
      const double mass = model.work.nodes[i].mass / D;
      const double first = step.stage.carried[i][a] / (1 - stage_fraction);
      const double error = step.stage.dt * (end_velocity(model, step, static_cast<Index>(i), a) - first);
      sums[0] += mass;
      sums[1] += D * mass * error * error;
    }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  return sums[0] > 0 ? std::sqrt(sums[1] / sums[0]) : 0;
}

template <int D>
void impose_supports(Model<D>& model, const ImplicitStep<D>& step)
{
  for (const Support<D>& support : model.supports)
    if (step.active[support.node])
      impose<D>(support, model.work.velocity[support.node]);
}

template <int D>
void start_step(Model<D>& model, ImplicitStep<D>& step, const ImplicitOptions& options, double dt)
{
  prepare(model);
  Workspace<D>& work = model.work;
  step.options = options;
  step.length = dt;
  step.dt = options.second_order ? stage_fraction * dt : dt;
  model.integration = options.integration;
  map_to_nodes(model); // (11), (15)
  find_start_velocity(model);
  find_active(model, step);
  if (options.damping > 0)
    step.frequency = shear_frequencies(model);
  else
    step.frequency.assign(work.nodes.size(), 0.0);
  if (options.quasi_static)
    std::fill(work.start_velocity.begin(), work.start_velocity.end(), Vector<D>{});
  if (model.exchange.size > 1 && !step.halos_ready)
    step.halos = make_halos(model.mesh, model.exchange.comm);
  step.halos_ready = true;
  update(step.halos.nodes, work.start_velocity);
  step.ghosts = find_ghost_facets(model, step.halos, options.ghost);
  step.stage = {step.dt, 1, work.start_velocity, {}, {}};
  work.velocity = work.start_velocity;
  impose_supports(model, step);

  step.forces.assign(work.nodes.size(), {});
  find_external(model, step);
}

template <int D>
void start_second_stage(Model<D>& model, ImplicitStep<D>& step)
{
  Workspace<D>& work = model.work;
  const double g = stage_fraction;
  Stage<D> second{g * step.length, g, work.start_velocity, work.velocity, {}};
  second.before.resize(work.nodes.size());
  for (std::size_t i = 0; i < work.nodes.size(); ++i)
  {
    const MeanForces<D> first = mean_forces(model, step, static_cast<Index>(i));
    for (int a = 0; a < D; ++a)
    {
      const double gained = work.velocity[i][a] - work.start_velocity[i][a];
      second.start[i][a] += (1 - g) / g * gained;
      second.carried[i][a] *= 1 - g;
      work.velocity[i][a] += (1 - g) * gained; // as if the acceleration went on, v2 = v0 + (v1 - v0) / g
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

template <int D>
TrialReport find_residual(Model<D>& model, ImplicitStep<D>& step, bool tangents)
{
  update(step.halos.nodes, model.work.velocity);
  if (step.options.mixed_discretisation)
    average_strains(model, step.dt);
  const TrialCount<D> count = try_stresses(model, step, tangents);
  if (step.options.average_stress)
    average_stresses<D>(model, step.stress);
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
  for (Support<D> held : model.supports)
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
  step.trouble = sums[5] > 0 ? shared_trouble(model.exchange, count.trouble) : std::nullopt;
  return {std::sqrt(sums[0]), std::sqrt(std::max({sums[1], sums[2], sums[3]})), static_cast<std::int64_t>(sums[4]),
          static_cast<std::int64_t>(sums[5])};
}

template <int D>
bool finish_step(Model<D>& model, const ImplicitStep<D>& step)
{
  Workspace<D>& work = model.work;
  const ImplicitOptions& options = step.options;
  for (std::size_t i = 0; i < work.velocity.size(); ++i)
    for (int a = 0; a < D; ++a)
      work.acceleration[i][a] =
          options.quasi_static
              ? 0
              : (end_velocity(model, step, static_cast<Index>(i), a) - work.start_velocity[i][a]) / step.length;
  if (options.mixed_discretisation)
    average_strains(model, step.dt);
  const Particles<D> start = model.particles;
  // Quasi-static: PIC with grid velocities of zero leaves the particles at rest.
  double pic = options.quasi_static ? 1 : 0;
  if (!options.quasi_static && options.pic > 0)
    pic = pic_share_of_step(options.pic, step.dt, critical_time_step(model));
  find_velocity_change(model, pic, step.dt);
  particle_pass<D>(model, {step.dt, !options.hold_positions, true, pic, options.mixed_discretisation, law_dt(step),
                           options.hold_positions}); // (18), (20), stresses
  agree_on_trouble(model);
  if (work.trouble)
  {
    model.particles = start;
    work.leavers.clear();
    work.outflow.clear();
    work.far_partners.clear();
    work.ready = false;
    return false;
  }
  tally(model, step);
  model.energy.ahead = 0; // velocities and stresses are of one time
  settle_particles(model);
  model.time += step.dt;
  ++model.totals.steps;
  model.totals.particle_steps += model.particles.size();
  if (options.quasi_static) // without inertia, what the loads do beyond the stresses' work goes nowhere
    start_energy_balance(model);
  // So that the out-of-balance ratio is that of the particles as they are now. Nodes that the soil has just left keep
  // the velocities of this step until the next one.
  const bool shrinks = std::exchange(work.soil_shrinks, false);
  map_to_nodes(model);
  work.soil_shrinks = shrinks;
  for (std::size_t i = 0; options.average_stress && i < step.forces.size(); ++i)
    work.nodes[i].internal = step.forces[i].internal;
  return true;
}

#define INSTANTIATE(D)                                                                                                 \
  template Inertia inertia_force(const Model<D>&, const ImplicitStep<D>&, Index, int);                                 \
  template Inertia stage_inertia(const Model<D>&, const ImplicitStep<D>&, Index, double, double);                      \
  template double displacement_error(const Model<D>&, const ImplicitStep<D>&);                                         \
  template void impose_supports(Model<D>&, const ImplicitStep<D>&);                                                    \
  template void start_second_stage(Model<D>&, ImplicitStep<D>&);                                                       \
  template void start_step(Model<D>&, ImplicitStep<D>&, const ImplicitOptions&, double);                               \
  template TrialReport find_residual(Model<D>&, ImplicitStep<D>&, bool);                                               \
  template bool finish_step(Model<D>&, const ImplicitStep<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
