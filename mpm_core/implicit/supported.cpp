#include "implicit/supported.h"

namespace mpm::implicit
{
template <class G>
void impose_supports(const ImplicitStep<G>& step, VelocityField<G>& field)
{
  for (const auto& support : field.supports)
    if (step.active[support.node])
      impose<G::dim>(support, field.velocity[support.node]);
}

template <int D>
void add_support_entries(const ImplicitSystem<D>& system, TangentSum<D>& tangent)
{
  for (Index node : system.owned)
  {
    if (system.support[node] == none)
      continue;
    Matrix<D> block = projector(system, node);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        block[i][j] = system.diagonal[node] * ((i == j ? 1.0 : 0.0) - block[i][j]);
    tangent.add_unprojected(node, node, block);
  }
}

template void add_support_entries(const ImplicitSystem<2>&, TangentSum<2>&);
template void add_support_entries(const ImplicitSystem<3>&, TangentSum<3>&);
#define INSTANTIATE(G) template void impose_supports(const ImplicitStep<G>&, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
