#include "transfer/nodes.h"

#include "transfer/affine_field.h"

namespace mpm::transfer
{
template <class G>
void scatter_momentum(const Mesh<G::dim>& mesh, NodeExchange& exchange, const MeshPart& part,
                      std::span<const CellMoments<G>> cells, std::span<const Vector<G::dim>> change,
                      std::span<Vector<G::dim>> momentum)
{
  constexpr int D = G::dim;
  const auto nodal = [change](Index node) -> const Vector<D>& { return change[node]; };
  const auto each_term = [&](auto&& add)
  {
    for (Index c : part.cells)
    {
      if (cells[c].mass == 0)
        continue;
      const AffineField<D> f = affine_field<D>(mesh, c, nodal);
      const auto gradients = gradients_by_vertex<D>(mesh.shapes[c]);
      std::array<ByVertex<D>, D> sums;
      for (int a = 0; a < D; ++a)
      {
        const double sum = cells[c].mass * f.value[a] + dot<D>(f.gradient[a], cells[c].mass_xi);
        Vector<D> first; // its first moment
        for (int b = 0; b < D; ++b)
        {
          first[b] = f.value[a] * cells[c].mass_xi[b];
          for (int d = 0; d < D; ++d)
            first[b] += f.gradient[a][d] * cells[c].mass_xixi[symmetric_index<D>(d, b)];
        }
        sums[a] = at_vertices<D>(sum, first, gradients);
      }
      for (int k = 0; k <= D; ++k)
      {
        Vector<D> term;
        for (int a = 0; a < D; ++a)
          term[a] = sums[a][k];
        add(mesh.cells[c][k], term);
      }
    }
  };
  for (Index node : part.nodes)
    momentum[node] = {};
  sum_at_nodes<Vector<D>>(
      exchange, [momentum](Index node) -> Vector<D>& { return momentum[node]; }, each_term);
}

#define INSTANTIATE(G)                                                                                                 \
  template void scatter_momentum<G>(const Mesh<G::dim>&, NodeExchange&, const MeshPart&,                               \
                                    std::span<const CellMoments<G>>, std::span<const Vector<G::dim>>,                  \
                                    std::span<Vector<G::dim>>);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::transfer
