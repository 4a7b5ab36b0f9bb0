#include "implicit/inertia.h"

#include <cmath>

namespace mpm::implicit
{
template <class G>
Inertia stage_inertia(const ImplicitStep<G>& step, double mass, Index node, double start, double end)
{
  const double resolved = left_by_backward_euler(step.frequency[node] * step.length);
  Inertia inertia =
      damped_inertia(mass, start, end, step.stage.dt, step.options.damping, step.frequency[node], resolved);
  inertia.force += step.options.mass_damping * mass * end;
  inertia.derivative += step.options.mass_damping * mass;
  inertia.derivative /= step.stage.weight;
  return inertia;
}

namespace
{
/// Inertia of the iterate.
template <class G>
Inertia iterate_inertia(const VelocityField<G>& field, const ImplicitStep<G>& step, Index node, int component)
{
  return stage_inertia(step, field.nodes[node].mass, node, step.stage.start[node][component],
                       end_velocity(step, field, node, component));
}
} // namespace

template <class G, int D>
void add_inertia_forces(const VelocityField<G>& field, const ImplicitStep<G>& step,
                        std::span<const unsigned char> owned, std::vector<NodalForces<D>>& forces)
{
  if (step.options.quasi_static)
    return;
  for (std::size_t i = 0; i < forces.size(); ++i)
    for (int a = 0; a < D && owned[i] && step.active[i]; ++a)
      forces[i].inertia[a] += iterate_inertia(field, step, static_cast<Index>(i), a).force;
}

template <class G, int D>
void add_inertia_entries(const VelocityField<G>& field, const ImplicitStep<G>& step, std::span<const Index> owned,
                         TangentSum<D>& tangent)
{
  for (Index node : owned)
  {
    Matrix<D> block{};
    for (int a = 0; a < D && !step.options.quasi_static; ++a)
      block[a][a] = iterate_inertia(field, step, node, a).derivative / step.dt;
    tangent.add(node, node, block);
  }
}

template <int D>
std::vector<double> shear_frequencies(std::span<const double> stiffness, std::span<const NodeSums<D>> nodes)
{
  std::vector<double> frequency(nodes.size(), 0.0);
  for (std::size_t i = 0; i < frequency.size(); ++i)
    if (nodes[i].mass > 0)
      frequency[i] = std::sqrt(stiffness[i] / nodes[i].mass);
  return frequency;
}

template std::vector<double> shear_frequencies<2>(std::span<const double>, std::span<const NodeSums<2>>);
template std::vector<double> shear_frequencies<3>(std::span<const double>, std::span<const NodeSums<3>>);
#define INSTANTIATE(G)                                                                                                 \
  template Inertia stage_inertia(const ImplicitStep<G>&, double, Index, double, double);                               \
  template void add_inertia_forces(const VelocityField<G>&, const ImplicitStep<G>&, std::span<const unsigned char>,    \
                                   std::vector<NodalForces<G::dim>>&);                                                 \
  template void add_inertia_entries(const VelocityField<G>&, const ImplicitStep<G>&, std::span<const Index>,           \
                                    TangentSum<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
