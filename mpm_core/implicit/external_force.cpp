#include "implicit/external_force.h"

namespace mpm::implicit
{
template <int D>
std::vector<Vector<D>> external_forces(std::span<const NodeSums<D>> nodes, const Vector<D>& gravity,
                                       double load_fraction)
{
  std::vector<Vector<D>> external(nodes.size());
  for (std::size_t i = 0; i < nodes.size(); ++i)
  {
    external[i] = external_force<D>(nodes[i], gravity);
    for (int a = 0; a < D && load_fraction != 1; ++a)
      external[i][a] = nodes[i].internal[a] + load_fraction * (external[i][a] - nodes[i].internal[a]);
  }
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

template std::vector<Vector<2>> external_forces<2>(std::span<const NodeSums<2>>, const Vector<2>&, double);
template std::vector<Vector<3>> external_forces<3>(std::span<const NodeSums<3>>, const Vector<3>&, double);
#define INSTANTIATE(G)                                                                                                 \
  template void add_external_forces(const ImplicitStep<G>&, std::span<const unsigned char>,                            \
                                    std::vector<NodalForces<G::dim>>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
