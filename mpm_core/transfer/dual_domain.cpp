#include "transfer/dual_domain.h"

namespace mpm::transfer
{
template <int D>
void add_dual_stress(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                     DualStress<D>& cell, const std::array<DualStress<D>*, D + 1>& nodes)
{
  const auto add = [](DualStress<D>& sum, double volume, const std::array<double, n_symmetric<D>>& stress)
  {
    sum.volume += volume;
    for (int k = 0; k < n_symmetric<D>; ++k)
      sum.stress[k] += volume * stress[k];
  };
  for (Index p = first; p < last; ++p)
  {
    const DualWeights<D> weights = dual_weights<D>(shape, at<D>(particles.position, p));
    std::array<double, n_symmetric<D>> stress;
    for (int k = 0; k < n_symmetric<D>; ++k)
      stress[k] = particles.stress[stress_component<D>[k]][p];
    add(cell, weights.cell * particles.volume[p], stress);
    for (int k = 0; k <= D; ++k)
      add(*nodes[k], weights.node[k] * particles.volume[p], stress);
  }
}

template <int D>
std::array<double, n_symmetric<D>> dual_mean(const DualStress<D>& cell,
                                             const std::array<const DualStress<D>*, D + 1>& nodes)
{
  // Nodes, and the cell's part, that no particle has any weight in leave theirs to the others
  const double own = cell.volume > 0 ? dual_fraction * bubble_mean<D> : 0;
  double known = 0;
  for (const DualStress<D>* node : nodes)
    known += node->volume > 0 ? 1 : 0;
  std::array<double, n_symmetric<D>> mean{};
  for (int k = 0; k < n_symmetric<D>; ++k)
  {
    if (own > 0)
      mean[k] += own * cell.stress[k] / cell.volume;
    for (const DualStress<D>* node : nodes)
      if (node->volume > 0)
        mean[k] += (1 - own) / known * node->stress[k] / node->volume;
  }
  return mean;
}

#define INSTANTIATE(D)                                                                                                 \
  template void add_dual_stress<D>(const Particles<D>&, Index, Index, const CellShape<D>&, DualStress<D>&,             \
                                   const std::array<DualStress<D>*, D + 1>&);                                          \
  template std::array<double, n_symmetric<D>> dual_mean<D>(const DualStress<D>&,                                       \
                                                           const std::array<const DualStress<D>*, D + 1>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::transfer
