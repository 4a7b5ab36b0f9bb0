#include "transfer/nodes.h"

namespace mpm
{
template <int D>
void scatter(const Mesh<D>& mesh, const MeshPart& part, std::span<const CellMoments<D>> cells,
             std::span<const TractionMoments<D>> tractions, std::span<NodeSums<D>> nodes)
{
  for (Index node : part.nodes)
    nodes[node] = {};
  for (Index c : part.cells)
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
void scatter_momentum(const Mesh<D>& mesh, const MeshPart& part, std::span<const CellMoments<D>> cells, double keep,
                      std::span<const Vector<D>> change, std::span<Vector<D>> momentum)
{
  for (Index node : part.nodes)
    momentum[node] = {};
  const auto nodal = [change](Index node) -> const Vector<D>& { return change[node]; };
  for (Index c : part.cells)
  {
    if (cells[c].mass == 0)
      continue;
    const CellMomentum<D> sum = changed_momentum<D>(cells[c], keep, affine_field<D>(mesh, c, nodal));
    for (int k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        momentum[mesh.cells[c][k]][a] += at_vertex<D>(sum.value[a], sum.first[a], mesh.shapes[c].gradient[k]);
  }
}

#define INSTANTIATE(D)                                                                                                 \
  template void scatter<D>(const Mesh<D>&, const MeshPart&, std::span<const CellMoments<D>>,                           \
                           std::span<const TractionMoments<D>>, std::span<NodeSums<D>>);                               \
  template void scatter_momentum<D>(const Mesh<D>&, const MeshPart&, std::span<const CellMoments<D>>, double,          \
                                    std::span<const Vector<D>>, std::span<Vector<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
