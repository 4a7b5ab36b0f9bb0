#include "explicit/momentum.h"

#include "model/mapping.h"
#include "transfer/affine_field.h"

namespace mpm::explicit_scheme
{
template <class G>
void find_acceleration(const Vector<G::dim>& gravity, double damping, double dt, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  for (Index i : field.part.nodes)
  {
    const NodeSums<D>& node = field.nodes[i];
    const double per_mass = field.per_mass[i];
    // Components side by side: of single numbers g++ makes branches on the signs of velocities
    const Components<D> residual = components<D>(unbalanced_force<D>(node, gravity));
    const Components<D> momentum = node.mass * components<D>(field.start_velocity[i]);
    const Components<D> acceleration = (residual - local_damping(damping, residual, momentum, dt)) * per_mass;
    for (int a = 0; a < D; ++a)
      field.acceleration[i][a] = acceleration[a];
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
    for (int a = 0; a < G::dim; ++a)
      field.velocity[i][a] = (flip_fraction * node.momentum[a] + field.velocity[i][a]) * field.per_mass[i];
  }
  impose_supports<G>(field.velocity, field);
}

namespace
{
/// External force on a node, gravity included, and its displacement over the step
template <int D>
struct NodeWork
{
  Vector<D> external, displacement;
};

template <class G, int D = G::dim>
inline NodeWork<D> work_of_node(const VelocityField<G>& field, Index i, const Vector<G::dim>& gravity, double dt)
{
  NodeWork<D> work{external_force<D>(field.nodes[i], gravity), {}};
  for (int a = 0; a < D; ++a)
    work.displacement[a] = 0.5 * dt * (field.start_velocity[i][a] + field.velocity[i][a]);
  return work;
}

/// Work of the reactions at the nodes with boundary conditions: of what the forces on them leave of m_i a_i.
template <class G, int D = G::dim>
double work_of_supports(const VelocityField<G>& field, std::span<const unsigned char> owned,
                        const Vector<G::dim>& gravity, double damping, double dt)
{
  double sum = 0;
  for (const Support<D>& support : field.supports)
  {
    const Index i = support.node;
    if (!owned[i] || !field.part.has_node[i] || is_light(field, i))
      continue;
    const NodeSums<D>& node = field.nodes[i];
    const NodeWork<D> work = work_of_node(field, i, gravity, dt);
    for (int a = 0; a < D; ++a)
    {
      const double residual = work.external[a] - node.internal[a];
      const double drag = local_damping(damping, residual, node.mass * field.start_velocity[i][a], dt);
      sum += (node.mass * field.acceleration[i][a] - residual + drag) * work.displacement[a];
    }
  }
  return sum;
}
} // namespace

template <class G>
double add_work(const VelocityField<G>& field, std::span<const unsigned char> owned, const Vector<G::dim>& gravity,
                double damping, double dt, Totals& totals)
{
  constexpr int D = G::dim;
  using Row = Components<D>;
  Row at_end{}, external{}, internal{}, of_rest{}; // sums kept in registers need not wait for memory
  for (Index i : field.part.nodes)
  {
    const NodeSums<D>& node = field.nodes[i];
    if (!owned[i] || is_light(field, i))
      continue;
    const NodeWork<D> work = work_of_node(field, i, gravity, dt);
    const Row acting = components<D>(work.external), stress = components<D>(node.internal);
    const Row displacement = components<D>(work.displacement);
    external += acting * displacement;
    internal += stress * displacement;
    of_rest += (acting - stress - node.mass * components<D>(field.acceleration[i])) * displacement;
    at_end += dt * stress * components<D>(field.velocity[i]);
  }
  const auto sum_of = [](const Row& components)
  {
    double sum = 0;
    for (int a = 0; a < D; ++a)
      sum += components[a];
    return sum;
  };
  // What the forces leave of m_i a_i is the drag, and at boundary conditions the reactions too.
  const double of_supports = work_of_supports(field, owned, gravity, damping, dt);
  totals.external_work += sum_of(external);
  totals.internal_work += sum_of(internal);
  totals.support_work += of_supports;
  totals.damping_work += damping == 0 ? 0 : sum_of(of_rest) + of_supports;
  return sum_of(at_end);
}

template <class G>
void add_transfer_work(const VelocityField<G>& field, std::span<const unsigned char> owned, double dt, EnergyBook& book)
{
  double work = 0;
  for (Index i : field.part.nodes)
    if (owned[i] && !is_light(field, i))
      for (int a = 0; a < G::dim; ++a)
        work += 0.5 * dt * field.nodes[i].mass * field.acceleration[i][a] *
                (field.start_velocity[i][a] + field.velocity[i][a]);
  book.pic_loss += work;
}

#define INSTANTIATE(G)                                                                                                 \
  template void find_acceleration(const Vector<G::dim>&, double, double, VelocityField<G>&);                           \
  template void find_advanced_velocity(double, VelocityField<G>&);                                                     \
  template void find_mapped_velocity(double, VelocityField<G>&);                                                       \
  template double add_work(const VelocityField<G>&, std::span<const unsigned char>, const Vector<G::dim>&, double,     \
                           double, Totals&);                                                                           \
  template void add_transfer_work(const VelocityField<G>&, std::span<const unsigned char>, double, EnergyBook&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
