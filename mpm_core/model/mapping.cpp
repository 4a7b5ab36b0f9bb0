#include "model/mapping.h"

#include "model/integration.h"

namespace mpm
{
template <int D>
void map_to_nodes(Model<D>& model)
{
  const PhaseTimer timer(model.phase_seconds, Phase::node_sums);
  Workspace<D>& work = model.work;
  shrink_soil(model);
  scatter<D>(model.mesh, work.soil, work.moments, work.tractions, work.nodes);
  if (model.integration != Integration::particles)
    integrate_stress(model);
  sum_shared(model.exchange, work.nodes);
}

template <int D>
void find_start_velocity(Model<D>& model)
{
  Workspace<D>& work = model.work;
  for (Index i : work.soil.nodes)
    for (int a = 0; a < D; ++a)
      work.start_velocity[i][a] =
          work.nodes[i].mass > work.least_mass ? work.nodes[i].momentum[a] / work.nodes[i].mass : 0;
  for (const Support<D>& support : model.supports)
    impose<D>(support, work.start_velocity[support.node]);
}

template <int D>
void find_velocity_change(Model<D>& model, double pic_share, double dt)
{
  Workspace<D>& work = model.work;
  for (Index i : work.soil.nodes)
    for (int a = 0; a < D; ++a)
      work.velocity_change[i][a] = dt * work.acceleration[i][a] + pic_share * work.start_velocity[i][a];
}

template <int D>
void average_strains(Model<D>& model, double dt)
{
  const PhaseTimer timer(model.phase_seconds, Phase::averaging);
  Workspace<D>& work = model.work;
  const auto of_cell = [&](Index c) -> VolumetricStrain
  {
    double divergence = 0;
    for (int k = 0; k <= D; ++k)
      divergence += dot<D>(work.velocity[model.mesh.cells[c][k]], model.mesh.shapes[c].gradient[k]);
    return {dt * divergence, integrated_volume(model, c)};
  };
  average_volumetric_strain(model.mesh, work.soil, of_cell, model.exchange, work.volumetric_strain);
}

template <int D>
void average_stresses(Model<D>& model, std::span<std::array<double, n_symmetric<D>>> stress)
{
  Workspace<D>& work = model.work;
  const auto mean = [&](Index c)
  {
    double sum = 0;
    for (int a = 0; a < D; ++a)
      sum += stress[c][a];
    return sum / D;
  };
  const auto of_cell = [&](Index c) -> VolumetricStrain
  {
    const double volume = integrated_volume(model, c);
    return {volume > 0 ? mean(c) / volume : 0, volume};
  };
  std::vector<VolumetricStrain> nodes(model.mesh.points.size());
  average_volumetric_strain<D>(model.mesh, work.soil, of_cell, model.exchange, nodes);
  for (Index c : work.soil.cells)
  {
    const double average = mean_volumetric_strain<D>(model.mesh.cells[c], nodes);
    const double change = integrated_volume(model, c) * average - mean(c);
    for (int a = 0; a < D; ++a)
      stress[c][a] += change;
  }
}

#define INSTANTIATE(D)                                                                                                 \
  template void map_to_nodes(Model<D>&);                                                                               \
  template void find_start_velocity(Model<D>&);                                                                        \
  template void find_velocity_change(Model<D>&, double, double);                                                       \
  template void average_strains(Model<D>&, double);                                                                    \
  template void average_stresses<D>(Model<D>&, std::span<std::array<double, n_symmetric<D>>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
