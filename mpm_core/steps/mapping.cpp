#include "steps/mapping.h"

#include "steps/integration.h"

namespace mpm
{
template <int D>
void map_to_nodes(Model<D>& model)
{
  Workspace<D>& work = model.work;
  scatter<D>(model.mesh, work.moments, work.tractions, work.nodes);
  if (model.integration != Integration::particles)
    integrate_stress(model);
  sum_shared(model.exchange, work.nodes);
}

template <int D>
void find_start_velocity(Model<D>& model)
{
  Workspace<D>& work = model.work;
  for (std::size_t i = 0; i < work.nodes.size(); ++i)
    for (int a = 0; a < D; ++a)
      work.start_velocity[i][a] =
          work.nodes[i].mass > work.least_mass ? work.nodes[i].momentum[a] / work.nodes[i].mass : 0;
  for (const Support<D>& support : model.supports)
    impose<D>(support, work.start_velocity[support.node]);
}

template <int D>
void average_strains(Model<D>& model, double dt)
{
  Workspace<D>& work = model.work;
  const auto velocity = [&](Index i) -> const Vector<D>& { return work.velocity[i]; };
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    work.cell_volume[c] = integrated_volume(model, c);
    if (work.cell_volume[c] == 0)
      continue;
    const auto gradient = affine_field<D>(model.mesh, c, velocity).gradient;
    work.volumetric_strain[c] = 0;
    for (int a = 0; a < D; ++a)
      work.volumetric_strain[c] += dt * gradient[a][a];
  }
  average_volumetric_strain<D>(model.mesh, work.cell_volume, model.exchange, work.volumetric_sums,
                               work.volumetric_strain);
}

#define INSTANTIATE(D)                                                                                                 \
  template void map_to_nodes(Model<D>&);                                                                               \
  template void find_start_velocity(Model<D>&);                                                                        \
  template void average_strains(Model<D>&, double);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
