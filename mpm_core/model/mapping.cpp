#include "model/mapping.h"

#include "model/integration.h"
#include "model/pore_forces.h"

#include <algorithm>
#include <utility>

namespace mpm::model
{
namespace
{
/// Leaves the cells that have become empty out of a field's part of the mesh.
template <class G, int D = G::dim>
void shrink_part(const Mesh<D>& mesh, const NodeExchange& exchange, VelocityField<G>& field)
{
  std::vector<Index> cells;
  for (Index c = 0; c < mesh.owned_cells; ++c)
    if (field.moments[c].mass != 0)
      cells.push_back(c);
  const std::vector<Index> before = std::move(field.part.nodes);
  field.part = make_part<D>(mesh, cells, exchange.shared_nodes);
  for (Index node : before)
    if (!field.part.has_node[node])
    {
      field.nodes[node] = {};
      field.start_velocity[node] = field.acceleration[node] = field.velocity_change[node] = field.velocity[node] = {};
    }
}
} // namespace

template <class G, int D>
void particles_to_nodes(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                        const std::vector<Run>& runs, VelocityField<G>& field)
{
  if (std::exchange(field.part_shrinks, false))
    shrink_part(mesh, exchange, field);
  scatter<G>(mesh, field.part, field.moments, field.tractions, field.nodes);
  if (field.integration.kind == Integration::mixed)
    integrate_mixed(mesh, exchange, field);
  if constexpr (!G::has_hoop)
    if (field.integration.kind == Integration::dual_domain)
      integrate_dual_domains(mesh, exchange, particles, runs, field);
  field.integration.averaged_of_cell.clear();
  if (!field.integration.averaged_by_law.empty())
    average_forces(mesh, exchange, runs, field);
  add_pore_forces(mesh, particles, runs, field);
}

template <class G>
void map_to_nodes(Model<G>& model)
{
  for (VelocityField<G>& field : model.fields)
  {
    particles_to_nodes(model.mesh, model.exchange, model.particles, model.order.runs, field);
    if (model.water)
      add_surface_pressures(model.mesh, *model.water, field);
    sum_shared(model.exchange, field.nodes);
  }
}

template <class G>
void find_start_velocity(VelocityField<G>& field)
{
  for (Index i : field.part.nodes)
    for (int a = 0; a < G::dim; ++a)
      field.start_velocity[i][a] =
          field.nodes[i].mass > field.least_mass ? field.nodes[i].momentum[a] / field.nodes[i].mass : 0;
  for (const auto& support : field.supports)
    impose<G::dim>(support, field.start_velocity[support.node]);
}

template <class G>
void find_velocity_change(VelocityField<G>& field, double pic_fraction, double dt)
{
  for (Index i : field.part.nodes)
    for (int a = 0; a < G::dim; ++a)
      field.velocity_change[i][a] = dt * field.acceleration[i][a] + pic_fraction * field.start_velocity[i][a];
}

template <class G, int D>
void average_strains(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field, double dt)
{
  const auto volume_of = [&](Index c) { return integrated_volume(mesh, field, c); };
  const auto strain_of = [&](Index c, double volume)
  {
    double divergence = 0;
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D>& v = field.velocity[mesh.cells[c][k]];
      divergence += dot<D>(v, mesh.shapes[c].gradient[k]);
      if constexpr (G::has_hoop)
        divergence += v[0] * hoop_gradient<G>(mesh.shapes[c]);
    }
    return dt * divergence * volume;
  };
  average_over_nodes(mesh, field.part, volume_of, strain_of, exchange, field.volumetric_strain);
}

namespace
{
/// Sum of the mean of the normal components of a stress times volume.
template <class G>
double mean_of(const Working<G>& stress)
{
  double sum = 0;
  for (int k : normal_component<G>)
    sum += stress[k];
  return sum / G::n_normal;
}

/// The change of mean stress times volume of filled cells when it is averaged over nodes, handed to `take` cell by
/// cell.
template <class G, class StressOf, class Take>
void average_mean_stress(const Mesh<G::dim>& mesh, NodeExchange& exchange, VelocityField<G>& field,
                         StressOf&& stress_of, Take&& take)
{
  field.mean_stress.resize(mesh.points.size());
  auto& own = field.integration.mean_stress_of_cell; // kept for the second pass, since moments are far apart in memory
  own.resize(static_cast<std::size_t>(mesh.owned_cells));
  const auto volume_of = [&](Index c) { return own[c].volume = integrated_volume(mesh, field, c); };
  const auto integral_of = [&](Index c, double) { return own[c].value = mean_of<G>(stress_of(c)); };
  average_over_nodes(mesh, field.part, volume_of, integral_of, exchange, field.mean_stress);
  for (Index c : field.part.cells)
    if (const auto [integral, volume] = own[c]; volume != 0)
      take(c, volume * mean_of_nodes<G::dim>(mesh.cells[c], field.mean_stress) - integral);
}
} // namespace

template <class G, int D>
void average_stresses(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field,
                      std::span<Working<G>> stress)
{
  const auto stress_of = [&](Index c) -> const Working<G>& { return stress[c]; };
  average_mean_stress<G>(mesh, exchange, field, stress_of,
                         [&](Index c, double change)
                         {
                           for (int k : normal_component<G>)
                             stress[c][k] += change;
                         });
}

template <class G, int D>
void average_forces(const Mesh<D>& mesh, NodeExchange& exchange, const std::vector<Run>& runs, VelocityField<G>& field)
{
  const auto& by_law = field.integration.averaged_by_law;
  auto& averaged = field.integration.averaged_of_cell;
  averaged.assign(static_cast<std::size_t>(mesh.owned_cells), 1.0);
  for (const Run& run : runs)
    averaged[run.cell] = std::min(averaged[run.cell], by_law[run.material]);
  const auto stress_of = [&](Index c)
  {
    Working<G> stress = integrated_stress(mesh, field, c);
    for (double& component : stress)
      component *= averaged[c];
    return stress;
  };
  average_mean_stress<G>(mesh, exchange, field, stress_of,
                         [&](Index c, double change)
                         {
                           for (int k = 0; k <= D; ++k)
                           {
                             Vector<D>& force = field.nodes[mesh.cells[c][k]].internal;
                             for (int a = 0; a < D; ++a)
                               force[a] += change * mesh.shapes[c].gradient[k][a];
                             if constexpr (G::has_hoop)
                               force[0] += change * hoop_gradient<G>(mesh.shapes[c]);
                           }
                         });
}

#define INSTANTIATE(G)                                                                                                 \
  template void particles_to_nodes(const Mesh<G::dim>&, NodeExchange&, const Particles<G::dim>&,                       \
                                   const std::vector<Run>&, VelocityField<G>&);                                        \
  template void map_to_nodes(Model<G>&);                                                                               \
  template void find_start_velocity(VelocityField<G>&);                                                                \
  template void find_velocity_change(VelocityField<G>&, double, double);                                               \
  template void average_strains(const Mesh<G::dim>&, NodeExchange&, VelocityField<G>&, double);                        \
  template void average_stresses(const Mesh<G::dim>&, NodeExchange&, VelocityField<G>&, std::span<Working<G>>);        \
  template void average_forces(const Mesh<G::dim>&, NodeExchange&, const std::vector<Run>&, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
