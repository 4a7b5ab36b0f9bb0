#include "explicit/momentum.h"

#include "model/mapping.h"

namespace mpm::explicit_scheme
{
template <class G>
void find_acceleration(const Vector<G::dim>& gravity, double damping, double dt, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  for (Index i : field.part.nodes)
  {
    const NodeSums<D>& node = field.nodes[i];
    const double per_mass = is_light(field, i) ? 0 : 1 / node.mass;
    for (int a = 0; a < D; ++a)
    {
      const double residual = node.traction[a] + node.mass * gravity[a] - node.internal[a];
      const double drag = local_damping(damping, residual, node.mass * field.start_velocity[i][a], dt);
      field.acceleration[i][a] = (residual - drag) * per_mass;
    }
  }
  for (const Support<D>& support : field.supports)
  {
    const Vector<D>& start = field.start_velocity[support.node];
    Vector<D>& acceleration = field.acceleration[support.node];
    Vector<D> end;
    for (int a = 0; a < D; ++a)
      end[a] = start[a] + dt * acceleration[a];
    impose<D>(support, end);
    for (int a = 0; a < D; ++a)
      acceleration[a] = (end[a] - start[a]) / dt;
  }
}

template <class G>
void find_advanced_velocity(double dt, VelocityField<G>& field)
{
  for (Index i : field.part.nodes)
    for (int a = 0; a < G::dim; ++a)
      field.velocity[i][a] = field.start_velocity[i][a] + dt * field.acceleration[i][a];
}

template <class G>
void find_mapped_velocity(double flip_fraction, VelocityField<G>& field)
{
  for (Index i : field.part.nodes)
  {
    const auto& node = field.nodes[i];
    const double per_mass = is_light(field, i) ? 0 : 1 / node.mass;
    for (int a = 0; a < G::dim; ++a)
      field.velocity[i][a] = (flip_fraction * node.momentum[a] + field.velocity[i][a]) * per_mass;
  }
  for (const auto& support : field.supports)
    impose<G::dim>(support, field.velocity[support.node]);
}

template <class G>
double add_work(const VelocityField<G>& field, std::span<const unsigned char> owned, const Vector<G::dim>& gravity,
                double damping, double dt, Totals& totals)
{
  constexpr int D = G::dim;
  double at_end = 0;
  Totals sums; // beside the model's: a sum kept in a register need not wait for memory
  for (Index i : field.part.nodes)
  {
    const NodeSums<D>& node = field.nodes[i];
    if (!owned[i] || is_light(field, i))
      continue;
    const Vector<D>& start = field.start_velocity[i];
    for (int a = 0; a < D; ++a)
    {
      const double external = node.traction[a] + node.mass * gravity[a];
      const double u = 0.5 * dt * (start[a] + field.velocity[i][a]);
      const double residual = external - node.internal[a];
      const double drag = local_damping(damping, residual, node.mass * start[a], dt);
      sums.external_work += external * u;
      sums.internal_work += node.internal[a] * u;
      at_end += node.internal[a] * dt * field.velocity[i][a];
      sums.damping_work += drag * u;
      sums.support_work += (node.mass * field.acceleration[i][a] - residual + drag) * u;
    }
  }
  totals.external_work += sums.external_work;
  totals.internal_work += sums.internal_work;
  totals.damping_work += sums.damping_work;
  totals.support_work += sums.support_work;
  return at_end;
}

#define INSTANTIATE(G)                                                                                                 \
  template void find_acceleration(const Vector<G::dim>&, double, double, VelocityField<G>&);                           \
  template void find_advanced_velocity(double, VelocityField<G>&);                                                     \
  template void find_mapped_velocity(double, VelocityField<G>&);                                                       \
  template double add_work(const VelocityField<G>&, std::span<const unsigned char>, const Vector<G::dim>&, double,     \
                           double, Totals&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
