#include "transfer/nodes.h"

#include "transfer/affine_field.h"

namespace mpm::transfer
{
namespace
{
/// A number for each vertex of a cell. In three dimensions they fill a vector, so that the sums for all vertices take
/// the instructions of one.
template <int D>
using ByVertex = std::conditional_t<D == 3, Lanes, std::array<double, D + 1>>;

/// Derivatives of a cell's shape functions by each coordinate
template <int D>
std::array<ByVertex<D>, D> gradients_by_vertex(const CellShape<D>& shape)
{
  std::array<ByVertex<D>, D> gradients;
  for (int b = 0; b < D; ++b)
    for (int k = 0; k <= D; ++k)
      gradients[b][k] = shape.gradient[k][b];
  return gradients;
}

template <int D>
void add(double factor, const ByVertex<D>& gradients, ByVertex<D>& sums)
{
  if constexpr (D == 3)
    sums += factor * gradients;
  else
    for (int k = 0; k <= D; ++k)
      sums[k] += factor * gradients[k];
}

/// sum over particles of q_p N_k(x_p) for all vertices k, from its zeroth and first moment
template <int D>
ByVertex<D> at_vertices(double zeroth, const Vector<D>& first, const std::array<ByVertex<D>, D>& gradients)
{
  ByVertex<D> sums;
  for (int k = 0; k <= D; ++k)
    sums[k] = zeroth * (1.0 / (D + 1));
  for (int b = 0; b < D; ++b)
    add<D>(first[b], gradients[b], sums);
  return sums;
}

/// f_int of all vertices of a cell in a direction; by the hoop stress it is the same for all, and radial
template <class G>
ByVertex<G::dim> internal_forces(const Working<G>& stress, int a, const std::array<ByVertex<G::dim>, G::dim>& gradients,
                                 const CellShape<G::dim>& shape)
{
  constexpr int D = G::dim;
  ByVertex<D> forces{};
  if constexpr (G::has_hoop)
    if (a == 0)
      forces.fill(stress[n_symmetric<D>] * hoop_gradient<G>(shape));
  for (int b = 0; b < D; ++b)
    add<D>(stress[symmetric_index<D>(a, b)], gradients[b], forces);
  return forces;
}

template <int D>
void scatter_tractions(const Mesh<D>& mesh, Index cell, const TractionMoments<D>& moments, std::span<NodeSums<D>> nodes)
{
  for (int k = 0; k <= D; ++k)
    for (int a = 0; a < D; ++a)
      nodes[mesh.cells[cell][k]].traction[a] +=
          at_vertex<D>(moments.force[a], moments.force_xi[a], mesh.shapes[cell].gradient[k]);
}
} // namespace

template <class G>
void scatter(const Mesh<G::dim>& mesh, const MeshPart& part, std::span<const CellMoments<G>> cells,
             std::span<const TractionMoments<G::dim>> tractions, std::span<NodeSums<G::dim>> nodes)
{
  constexpr int D = G::dim;
  for (Index node : part.nodes)
    nodes[node] = {};
  for (Index c : part.cells)
  {
    const CellMoments<G>& moments = cells[c];
    if (moments.mass == 0)
      continue;
    const auto gradients = gradients_by_vertex<D>(mesh.shapes[c]);
    const ByVertex<D> mass = at_vertices<D>(moments.mass, moments.mass_xi, gradients);
    std::array<ByVertex<D>, D> momentum, internal;
    for (int a = 0; a < D; ++a)
    {
      momentum[a] = at_vertices<D>(moments.momentum[a], moments.momentum_xi[a], gradients);
      internal[a] = internal_forces<G>(moments.stress, a, gradients, mesh.shapes[c]);
    }
    for (int k = 0; k <= D; ++k)
    {
      NodeSums<D>& node = nodes[mesh.cells[c][k]];
      node.mass += mass[k];
      for (int a = 0; a < D; ++a)
      {
        node.momentum[a] += momentum[a][k];
        node.internal[a] += internal[a][k];
      }
    }
    if (!tractions.empty())
      scatter_tractions<D>(mesh, c, tractions[c], nodes);
  }
}

template <class G>
void scatter_momentum(const Mesh<G::dim>& mesh, const MeshPart& part, std::span<const CellMoments<G>> cells,
                      std::span<const Vector<G::dim>> change, std::span<Vector<G::dim>> momentum)
{
  constexpr int D = G::dim;
  for (Index node : part.nodes)
    momentum[node] = {};
  const auto nodal = [change](Index node) -> const Vector<D>& { return change[node]; };
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
      for (int a = 0; a < D; ++a)
        momentum[mesh.cells[c][k]][a] += sums[a][k];
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void scatter<G>(const Mesh<G::dim>&, const MeshPart&, std::span<const CellMoments<G>>,                      \
                           std::span<const TractionMoments<G::dim>>, std::span<NodeSums<G::dim>>);                     \
  template void scatter_momentum<G>(const Mesh<G::dim>&, const MeshPart&, std::span<const CellMoments<G>>,             \
                                    std::span<const Vector<G::dim>>, std::span<Vector<G::dim>>);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::transfer
