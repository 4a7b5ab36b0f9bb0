#include "implicit/averaging.h"

#include "model/integration.h"

namespace mpm::implicit
{
template <class G, int D>
void volumetric_force_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                              BlockEntries& entries)
{
  BlockSum sum(entries, {system.unknowns, 1}, system.number, numbers_of_means(system));
  const bool dries = step.pore.flows && !step.pore.drying.empty();
  for (Index c : step.cells)
  {
    const auto means = means_of(mesh, system.groups, c);
    for (int k = 0; k <= D; ++k)
    {
      Vector<D> force = internal_force<G>(step.tangents[c].by_volumetric, mesh.shapes[c], k);
      if (const CellContact<D>* at_surface = step.contact.in(c))
        for (int i = 0; i < D; ++i)
          force[i] += at_surface->by_volumetric[k][i];
      force = product<D>(projector(system, mesh.cells[c][k]), force);
      for (int l = 0; l <= D; ++l) // the cell has the mean of its vertices
      {
        double* block = sum.next(mesh.cells[c][k], means[l]);
        for (int a = 0; a < D; ++a)
          block[a] += force[a] / (D + 1);
        if (dries && !step.pore.held[mesh.cells[c][k]])
          block[D] -= step.pore.unit * step.pore.drying[c].wet[k] / (D + 1);
      }
    }
  }
}

template <class G, int D>
void volumetric_strain_entries(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitSystem<D>& system,
                               BlockEntries& entries)
{
  BlockSum sum(entries, {1, system.unknowns}, numbers_of_means(system), system.number);
  for (Index c : system.cells)
    for (Index mean : means_of(mesh, system.groups, c))
    {
      const double volume = averaged_strain_volume(mesh, field, c);
      const double weight = volume == 0 ? 0 : volume / field.volumetric_strain[mean].volume;
      for (int l = 0; l <= D; ++l)
      {
        const Index other = mesh.cells[c][l];
        const Vector<D> change = product<D>(projector(system, other), dilation_gradient<G>(mesh.shapes[c], l));
        double* block = sum.next(mean, other);
        for (int b = 0; b < D; ++b)
          block[b] += weight * change[b];
      }
    }
  // Places for the ghost penalty between cells of different groups, which have no mean in common.
  for (int group = 0; system.groups.count > 1 && group < system.groups.count; ++group)
    for (const auto [first, second] : system.ghosts)
    {
      sum.next(first * system.groups.count + group, second);
      sum.next(second * system.groups.count + group, first);
    }
}

template <class G, int D>
void mean_stress_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                         BlockEntries& by_displacement, BlockEntries& by_strain)
{
  const auto means = numbers_of_means(system);
  BlockSum displacement(by_displacement, {1, system.unknowns}, means, system.number),
      strain(by_strain, {1, 1}, means, means);
  for (Index c : step.cells)
  {
    const CellTangent<G>& tangent = step.tangents[c];
    const auto vertices = means_of(mesh, system.groups, c);
    for (int l = 0; l <= D; ++l)
    {
      const Index other = mesh.cells[c][l];
      Vector<D> change{};
      const auto rows = gradient_rows<G>(mesh.shapes[c], l);
      for (int b = 0; b < D; ++b)
        for (int m = 0; m < n_gradient<G>; ++m)
          change[b] += tangent.mean_by_gradient[m] * rows[b][m] / (D + 1);
      change = product<D>(projector(system, other), change);
      for (Index row : vertices)
      {
        double* block = displacement.next(row, other);
        for (int b = 0; b < D; ++b)
          block[b] += change[b];
        *strain.next(row, vertices[l]) += tangent.mean_by_volumetric / ((D + 1) * (D + 1));
      }
    }
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void volumetric_force_entries(const Mesh<G::dim>&, const ImplicitStep<G>&, const ImplicitSystem<G::dim>&,   \
                                         BlockEntries&);                                                               \
  template void volumetric_strain_entries(const Mesh<G::dim>&, const VelocityField<G>&, const ImplicitSystem<G::dim>&, \
                                          BlockEntries&);                                                              \
  template void mean_stress_entries(const Mesh<G::dim>&, const ImplicitStep<G>&, const ImplicitSystem<G::dim>&,        \
                                    BlockEntries&, BlockEntries&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
