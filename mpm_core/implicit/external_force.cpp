#include "implicit/external_force.h"

#include "model/far_field.h"

namespace mpm::implicit
{
template <class G>
std::vector<Vector<G::dim>> external_forces(const VelocityField<G>& field, const Vector<G::dim>& gravity,
                                            double load_fraction)
{
  constexpr int D = G::dim;
  const auto& nodes = field.nodes;
  std::vector<Vector<D>> external(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
    external[i] = external_force<D>(nodes[i], gravity);
  add_far_field_forces<D>(field.far_field, gravity, external);
  for (std::size_t i = 0; i < nodes.size() && load_fraction != 1; ++i)
    for (int a = 0; a < D; ++a)
      external[i][a] = nodes[i].internal[a] + load_fraction * (external[i][a] - nodes[i].internal[a]);
  return external;
}

template <class G, int D>
void add_external_forces(const ImplicitStep<G>& step, std::span<const unsigned char> owned,
                         std::vector<NodalForces<D>>& forces)
{
  for (std::size_t i = 0; i < forces.size(); ++i)
    if (owned[i])
      forces[i].external = step.external[i];
}

#define INSTANTIATE(G)                                                                                                 \
  template std::vector<Vector<G::dim>> external_forces(const VelocityField<G>&, const Vector<G::dim>&, double);        \
  template void add_external_forces(const ImplicitStep<G>&, std::span<const unsigned char>,                            \
                                    std::vector<NodalForces<G::dim>>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
