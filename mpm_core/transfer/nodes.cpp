#include "transfer/nodes.h"

#include <algorithm>

namespace mpm
{
template <int D>
void scatter(const Mesh<D>& mesh, std::span<const CellMoments<D>> cells, std::span<const TractionMoments<D>> tractions,
             std::span<NodeSums<D>> nodes)
{
  std::fill(nodes.begin(), nodes.end(), NodeSums<D>{});
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    const CellMoments<D>& moments = cells[c];
    if (moments.mass == 0)
      continue;
    for (int k = 0; k <= D; ++k)
    {
      NodeSums<D>& node = nodes[mesh.cells[c][k]];
      const Vector<D>& gradient = mesh.shapes[c].gradient[k];
      const Vector<D> force = internal_force<D>(moments.stress, gradient);
      node.mass += at_vertex<D>(moments.mass, moments.mass_xi, gradient);
      for (int a = 0; a < D; ++a)
      {
        node.momentum[a] += at_vertex<D>(moments.momentum[a], moments.momentum_xi[a], gradient);
        node.internal[a] += force[a];
      }
      if (!tractions.empty())
        for (int a = 0; a < D; ++a)
          node.traction[a] += at_vertex<D>(tractions[c].force[a], tractions[c].force_xi[a], gradient);
    }
  }
}

template <int D>
void scatter_momentum(const Mesh<D>& mesh, std::span<const CellMoments<D>> cells, std::span<Vector<D>> momentum)
{
  std::fill(momentum.begin(), momentum.end(), Vector<D>{});
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    if (cells[c].mass == 0)
      continue;
    for (int k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        momentum[mesh.cells[c][k]][a] +=
            at_vertex<D>(cells[c].momentum[a], cells[c].momentum_xi[a], mesh.shapes[c].gradient[k]);
  }
}

#define INSTANTIATE(D)                                                                                                 \
  template void scatter<D>(const Mesh<D>&, std::span<const CellMoments<D>>, std::span<const TractionMoments<D>>,       \
                           std::span<NodeSums<D>>);                                                                    \
  template void scatter_momentum<D>(const Mesh<D>&, std::span<const CellMoments<D>>, std::span<Vector<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
