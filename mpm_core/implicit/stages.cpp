#include "implicit/stages.h"

#include "implicit/damped_inertia.h"

#include <cmath>

namespace mpm::implicit
{
namespace
{
/// Adds forces times a weight.
template <int D>
void add_weighted(double weight, const NodalForces<D>& forces, NodalForces<D>& sum)
{
  for (int a = 0; a < D; ++a)
  {
    sum.external[a] += weight * forces.external[a];
    sum.internal[a] += weight * forces.internal[a];
    sum.ghost[a] += weight * forces.ghost[a];
    sum.inertia[a] += weight * forces.inertia[a];
  }
}
} // namespace

template <class G, int D>
NodalForces<D> mean_forces(const ImplicitStep<G>& step, Index node)
{
  NodalForces<D> mean = step.stage.before.empty() ? NodalForces<D>{} : step.stage.before[node];
  add_weighted(step.stage.weight, step.forces[node], mean);
  return mean;
}

template <class G>
void begin_first_stage(const VelocityField<G>& field, ImplicitStep<G>& step)
{
  step.dt = step.options.second_order ? stage_fraction * step.length : step.length;
  step.stage = {step.dt, 1, field.start_velocity, {}, {}};
}

template <class G>
void begin_second_stage(VelocityField<G>& field, ImplicitStep<G>& step)
{
  constexpr double g = stage_fraction;
  Stage<G::dim> second{g * step.length, g, field.start_velocity, field.velocity, {}};
  second.before.resize(field.velocity.size());
  for (std::size_t i = 0; i < second.before.size(); ++i)
  {
    add_weighted(1 - g, mean_forces(step, static_cast<Index>(i)), second.before[i]);
    for (int a = 0; a < G::dim; ++a)
    {
      const double gained = field.velocity[i][a] - field.start_velocity[i][a];
      second.start[i][a] += (1 - g) / g * gained;
      second.carried[i][a] *= 1 - g;
      field.velocity[i][a] += (1 - g) * gained; // as if the acceleration went on, v2 = v0 + (v1 - v0) / g
    }
  }
  step.stage = std::move(second);
  step.dt = step.length;
}

template <class G>
void find_acceleration(const ImplicitStep<G>& step, VelocityField<G>& field)
{
  for (std::size_t i = 0; i < field.velocity.size(); ++i)
    for (int a = 0; a < G::dim; ++a)
      field.acceleration[i][a] =
          step.options.quasi_static
              ? 0
              : (end_velocity(step, field, static_cast<Index>(i), a) - field.start_velocity[i][a]) / step.length;
}

template <class G>
double displacement_error(const NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step)
{
  constexpr int D = G::dim;
  std::array<double, 2> sums{}; // mass, and mass times the squares
  for (std::size_t i = 0; i < step.stage.carried.size(); ++i)
    for (int a = 0; a < D && exchange.owned[i]; ++a)
    {
      const double mass = field.nodes[i].mass / D;
      const double first = step.stage.carried[i][a] / (1 - stage_fraction);
      const double error = step.stage.dt * (end_velocity(step, field, static_cast<Index>(i), a) - first);
      sums[0] += mass;
      sums[1] += D * mass * error * error;
    }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, exchange.comm);
  return sums[0] > 0 ? std::sqrt(sums[1] / sums[0]) : 0;
}

template <class G>
void add_work(const VelocityField<G>& field, const ImplicitStep<G>& step, std::span<const unsigned char> owned,
              Totals& totals)
{
  for (std::size_t i = 0; i < field.nodes.size(); ++i)
  {
    if (!owned[i])
      continue;
    const auto mean = mean_forces(step, static_cast<Index>(i));
    for (int a = 0; a < G::dim; ++a)
    {
      const double u = step.dt * field.velocity[i][a];
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

#define INSTANTIATE(G)                                                                                                 \
  template NodalForces<G::dim> mean_forces(const ImplicitStep<G>&, Index);                                             \
  template void begin_first_stage(const VelocityField<G>&, ImplicitStep<G>&);                                          \
  template void begin_second_stage(VelocityField<G>&, ImplicitStep<G>&);                                               \
  template void find_acceleration(const ImplicitStep<G>&, VelocityField<G>&);                                          \
  template double displacement_error(const NodeExchange&, const VelocityField<G>&, const ImplicitStep<G>&);            \
  template void add_work(const VelocityField<G>&, const ImplicitStep<G>&, std::span<const unsigned char>, Totals&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
