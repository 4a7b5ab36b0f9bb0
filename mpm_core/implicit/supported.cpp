#include "implicit/supported.h"

#include <algorithm>

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
void add_support_entries(const ImplicitSystem<D>& system, BlockWriter<D>& tangent)
{
  const auto is_supported = [&](Index node) { return system.support[node] != none; };
  tangent.expect(static_cast<std::size_t>(std::ranges::count_if(system.owned, is_supported)));
  for (Index node : system.owned)
  {
    if (!is_supported(node))
      continue;
    Matrix<D> block = projector(system, node);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        block[i][j] = system.diagonal[node] * ((i == j ? 1.0 : 0.0) - block[i][j]);
    tangent.add_unprojected(node, node, block);
  }
}

template void add_support_entries(const ImplicitSystem<2>&, BlockWriter<2>&);
template void add_support_entries(const ImplicitSystem<3>&, BlockWriter<3>&);
#define INSTANTIATE(G) template void impose_supports(const ImplicitStep<G>&, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
