#include "implicit/internal_force.h"

#include "transfer/nodes.h"

namespace mpm::implicit
{
template <class G, int D>
void add_internal_forces(const Mesh<D>& mesh, const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces)
{
  for (Index c : step.cells)
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> force = internal_force<G>(step.stress[c], mesh.shapes[c], k);
      for (int a = 0; a < D; ++a)
        forces[mesh.cells[c][k]].internal[a] += force[a];
    }
}

namespace
{
/// d f_int of vertex k / du of vertex l of a cell
template <class G, int D = G::dim>
Matrix<D> cell_block(const CellTangent<G>& tangent, const CellShape<D>& shape, int k, int l)
{
  Matrix<D> block{};
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      for (int j = 0; j < D; ++j)
        for (int m = 0; m < D; ++m)
          block[a][b] +=
              shape.gradient[k][j] * tangent.by_gradient[symmetric_index<D>(a, j)][b * D + m] * shape.gradient[l][m];
  if constexpr (G::has_hoop)
  {
    const double hoop = hoop_gradient<G>(shape);
    const auto& by_hoop = tangent.by_gradient[n_symmetric<D>];
    for (int a = 0; a < D; ++a) // forces of stresses in the plane, by the hoop strain
      for (int j = 0; j < D; ++j)
        block[a][0] += shape.gradient[k][j] * tangent.by_gradient[symmetric_index<D>(a, j)][D * D] * hoop;
    for (int b = 0; b < D; ++b) // that of the hoop stress, by strains in the plane
      for (int m = 0; m < D; ++m)
        block[0][b] += hoop * by_hoop[b * D + m] * shape.gradient[l][m];
    block[0][0] += hoop * by_hoop[D * D] * hoop;
  }
  return block;
}
} // namespace

template <class G, int D>
void add_internal_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, TangentSum<D>& tangent)
{
  for (Index c : step.cells)
    for (int k = 0; k <= D; ++k)
      for (int l = 0; l <= D; ++l)
        tangent.add(mesh.cells[c][k], mesh.cells[c][l], cell_block(step.tangents[c], mesh.shapes[c], k, l));
}

#define INSTANTIATE(G)                                                                                                 \
  template void add_internal_forces(const Mesh<G::dim>&, const ImplicitStep<G>&, std::vector<NodalForces<G::dim>>&);   \
  template void add_internal_entries(const Mesh<G::dim>&, const ImplicitStep<G>&, TangentSum<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
