#include "explicit/explicit_step.h"

#include "model/integration.h"
#include "model/mapping.h"
#include "model/particle_pass.h"
#include "transfer/kinematics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm
{
namespace
{
/// a_i = (f_ext - f_int - D)_i / m_i, with supports; D_i = alpha |R_i| sign(v_i) per component, R = f_ext - f_int.
template <int D>
void solve_momentum(Model<D>& model, double damping, double dt)
{
  const PhaseTimer timer(model.phase_seconds, Phase::momentum);
  Workspace<D>& work = model.work;
  const Vector<D> gravity = current_gravity(model);
  for (Index i : work.soil.nodes)
  {
    const NodeSums<D>& node = work.nodes[i];
    const double per_mass = node.mass > work.least_mass ? 1 / node.mass : 0;
    for (int a = 0; a < D; ++a)
    {
      const double residual = node.traction[a] + node.mass * gravity[a] - node.internal[a];
      const double drag = local_damping(damping, residual, node.mass * work.start_velocity[i][a], dt);
      work.acceleration[i][a] = (residual - drag) * per_mass;
    }
  }
  for (const Support<D>& support : model.supports)
  {
    const Vector<D>& start = work.start_velocity[support.node];
    Vector<D>& acceleration = work.acceleration[support.node];
    Vector<D> end;
    for (int a = 0; a < D; ++a)
      end[a] = start[a] + dt * acceleration[a];
    impose<D>(support, end);
    for (int a = 0; a < D; ++a)
      acceleration[a] = (end[a] - start[a]) / dt;
  }
}

/// v_i at the end of the step. MUSL maps the new velocities of the particles back (19): what is kept of the old ones
/// gives the momentum of the step's start, and the moments tell what their changes give.
template <int D>
void find_end_velocity(Model<D>& model, const ExplicitOptions& options, double dt)
{
  const PhaseTimer timer(model.phase_seconds, Phase::mapping);
  Workspace<D>& work = model.work;
  find_velocity_change(model, options.pic_share, dt);
  if (options.stress_update != StressUpdate::modified_last)
  {
    for (Index i : work.soil.nodes)
      for (int a = 0; a < D; ++a)
        work.velocity[i][a] = work.start_velocity[i][a] + dt * work.acceleration[i][a];
    return;
  }
  scatter_momentum<D>(model.mesh, work.soil, work.moments, work.velocity_change, work.velocity);
  sum_shared(model.exchange, work.velocity);
  const double keep = 1 - options.pic_share;
  for (Index i : work.soil.nodes)
  {
    const NodeSums<D>& node = work.nodes[i];
    const double per_mass = node.mass > work.least_mass ? 1 / node.mass : 0;
    for (int a = 0; a < D; ++a)
      work.velocity[i][a] = (keep * node.momentum[a] + work.velocity[i][a]) * per_mass;
  }
  for (const Support<D>& support : model.supports)
    impose<D>(support, work.velocity[support.node]);
}

/// Work done in the step. Forces act at the step's start, so their displacement is the mean
/// of the one before and the one after: the energy balance of the leap-frog scheme.
/// @param strained  the stresses have been updated (USF): they are half a step behind the velocities, not ahead
template <int D>
void tally(Model<D>& model, double damping, double dt, bool strained)
{
  const PhaseTimer timer(model.phase_seconds, Phase::momentum);
  const Workspace<D>& work = model.work;
  const Vector<D> gravity = current_gravity(model);
  model.last.dt = dt;
  double ahead = 0;
  Totals sums; // beside the model's: a sum kept in a register need not wait for memory
  for (Index i : work.soil.nodes)
  {
    const NodeSums<D>& node = work.nodes[i];
    if (!model.exchange.owned[i] || !(node.mass > work.least_mass))
      continue;
    const Vector<D>& start = work.start_velocity[i];
    for (int a = 0; a < D; ++a)
    {
      const double external = node.traction[a] + node.mass * gravity[a];
      const double u = 0.5 * dt * (start[a] + work.velocity[i][a]);
      const double residual = external - node.internal[a];
      const double drag = local_damping(damping, residual, node.mass * start[a], dt);
      sums.external_work += external * u;
      sums.internal_work += node.internal[a] * u;
      ahead += node.internal[a] * dt * work.velocity[i][a];
      sums.damping_work += drag * u;
      sums.support_work += (node.mass * work.acceleration[i][a] - residual + drag) * u;
    }
  }
  model.totals.external_work += sums.external_work;
  model.totals.internal_work += sums.internal_work;
  model.totals.damping_work += sums.damping_work;
  model.totals.support_work += sums.support_work;
  if (strained)
    model.energy.ahead = -0.5 * ahead;
}
} // namespace

template <int D>
void explicit_step(Model<D>& model, const ExplicitOptions& options, double dt)
{
  Workspace<D>& work = model.work;
  const bool first = options.stress_update == StressUpdate::first;
  model.integration = options.integration;
  const bool dual = options.integration == Integration::dual_domain;
  map_to_nodes(model); // (11), (14), (15)
  find_start_velocity(model);
  if (first)
  {
    work.velocity = work.start_velocity;
    if (options.mixed_discretisation)
      average_strains(model, dt);
    if (dual)
      average_gradients(model);
    particle_pass<D>(model, {dt, false, true, 0, options.mixed_discretisation, dt});
    map_to_nodes(model); // the stresses have changed
  }
  solve_momentum(model, options.damping, dt);
  find_end_velocity(model, options, dt); // (19)
  tally(model, options.damping, dt, first);
  if (options.mixed_discretisation && !first)
    average_strains(model, dt);
  if (dual && !first)
    average_gradients(model);
  particle_pass<D>(model,
                   {dt, true, !first, options.pic_share, options.mixed_discretisation, dt}); // (18), (20), stresses
  agree_on_trouble(model);
  if (work.trouble)
    return;
  settle_particles(model);
  model.time += dt;
  ++model.totals.steps;
  model.totals.particle_steps += model.particles.size();
}

template <int D>
double out_of_balance(const Model<D>& model, const Vector<D>& gravity)
{
  std::array<double, 3> squares{}; // of f_ext - f_int over unsupported directions, of f_ext, and of reactions
  auto support = model.supports.begin();
  for (Index i = 0; i < model.mesh.n_nodes(); ++i)
  {
    while (support != model.supports.end() && support->node < i)
      ++support;
    const NodeSums<D>& node = model.work.nodes[i];
    if (!model.exchange.owned[i] || !(node.mass > model.work.least_mass))
      continue;
    Vector<D> external, unbalanced;
    for (int a = 0; a < D; ++a)
    {
      external[a] = node.traction[a] + node.mass * gravity[a];
      unbalanced[a] = external[a] - node.internal[a];
    }
    if (support != model.supports.end() && support->node == i)
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
  MPI_Allreduce(MPI_IN_PLACE, squares.data(), 3, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  const double acting = squares[1] > 0 ? squares[1] : squares[2];
  return acting > 0 ? std::sqrt(squares[0] / acting) : 0;
}

template <int D>
double critical_time_step(const Model<D>& model)
{
  double squared = std::numeric_limits<double>::infinity();
  for (const Run& run : model.work.runs)
  {
    const double h = smallest_altitude<D>(model.mesh.shapes[run.cell]);
    double density = std::numeric_limits<double>::infinity();
    for (Index p = run.first; p < run.last; ++p)
      density = std::min(density, model.particles.mass[p] / model.particles.volume[p]);
    squared = std::min(squared, h * h * density / p_wave_modulus(model.laws[run.material]));
  }
  MPI_Allreduce(MPI_IN_PLACE, &squared, 1, MPI_DOUBLE, MPI_MIN, model.exchange.comm);
  return std::sqrt(squared);
}

double pic_share_of_step(double share, double dt, double critical)
{
  return share == 0 ? 0 : -std::expm1(dt / critical * std::log1p(-share)); // 1 for a share of 1
}

#define INSTANTIATE(D)                                                                                                 \
  template void explicit_step(Model<D>&, const ExplicitOptions&, double);                                              \
  template double out_of_balance<D>(const Model<D>&, const Vector<D>&);                                                \
  template double critical_time_step(const Model<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
