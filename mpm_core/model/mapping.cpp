#include "model/mapping.h"

#include "model/pore_forces.h"
#include "model/resting_nodes.h"
#include "model/water_mapping.h"

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
  field.resting.others = {};
  for (Index node : before)
    if (!field.part.has_node[node])
    {
      field.nodes[node] = {};
      field.start_velocity[node] = field.acceleration[node] = field.velocity_change[node] = field.velocity[node] = {};
    }
}

/// Sum of the mean of the normal components of a stress times volume.
template <class G>
double mean_of(const Working<G>& stress)
{
  double sum = 0;
  for (int k : normal_component<G>)
    sum += stress[k];
  return sum * (1.0 / G::n_normal);
}

/// Averages over nodes the mean stress of filled cells. Only the fractions of stress and volume that are averaged take
/// part in the means: where soils of different fractions meet, a uniform pressure then remains in equilibrium.
/// @post integration.mean_stress_of_cell has what was averaged, for `change_by_averaging`
/// @param integral_of  mean stress times volume of a cell; a callable Index -> double
template <class G, class IntegralOf>
void average_mean_stress(const Mesh<G::dim>& mesh, NodeExchange& exchange, VelocityField<G>& field,
                         IntegralOf&& integral_of)
{
  auto& own = field.integration.mean_stress_of_cell; // kept for what follows, since moments are far apart in memory
  own.resize(static_cast<std::size_t>(mesh.owned_cells));
  const auto volume_of = [&](Index c)
  {
    own[c] = {0, averaged_volume(mesh, field, c)}; // cells that take no part have no integral
    return own[c].volume;
  };
  const auto keep_integral = [&](Index c, double)
  { return own[c].value = averaged_fraction(field.integration, c) * integral_of(c); };
  average_over_nodes(mesh, field.part, field.integration.groups, volume_of, keep_integral, exchange, field.mean_stress);
}

/// By how much averaging changes the mean stress times volume of a filled cell.
template <class G, int D = G::dim>
double change_by_averaging(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  const auto [integral, volume] = field.integration.mean_stress_of_cell[cell];
  return volume * mean_of_vertices<D>(mesh, field.integration.groups, cell, field.mean_stress) - integral;
}

/// Masses of the nodes, over all ranks, as they are and as they would be if the particles filled their cells evenly.
template <class G, int D = G::dim>
void find_masses(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field)
{
  auto& masses = field.integration.masses;
  masses.assign(mesh.points.size(), {});
  const auto each_term = [&](auto&& add)
  {
    for (Index c : field.part.cells)
    {
      const CellMoments<G>& moments = field.moments[c];
      const auto own = at_vertices<D>(moments.mass, moments.mass_xi, gradients_by_vertex<D>(mesh.shapes[c]));
      const double even = moments.mass * (1.0 / (D + 1));
      for (int k = 0; k <= D; ++k)
        add(mesh.cells[c][k], NodeMass{own[k], even});
    }
  };
  sum_at_nodes<NodeMass>(
      exchange, [&masses](Index node) -> NodeMass& { return masses[node]; }, each_term);
  sum_shared(exchange, masses);
}

/// The fraction of averaging in each cell: the least of its soils, and none where a node has little mass. Averages push
/// such a node by stresses around it, which do not fall when its cells expand: without resistance, particles that are
/// at the apex of their strength would expand without bounds there.
template <class G, int D = G::dim>
void find_averaged_fractions(const Mesh<D>& mesh, NodeExchange& exchange, const std::vector<Run>& runs,
                             VelocityField<G>& field)
{
  CellIntegration<D>& integration = field.integration;
  const auto& by_law = integration.averaged_by_law;
  const bool same = std::ranges::all_of(by_law, [&](double fraction) { return fraction == by_law.front(); });
  integration.averaged_of_cell.assign(static_cast<std::size_t>(mesh.owned_cells), same ? by_law.front() : 1.0);
  if (!same)
    for (const std::span<const Run> each : {std::span(runs), std::span(std::as_const(field.resting.runs))})
      for (const Run& run : each)
        integration.averaged_of_cell[run.cell] = std::min(integration.averaged_of_cell[run.cell], by_law[run.material]);
  find_masses(mesh, exchange, field);
  const auto has_little = [&masses = integration.masses](Index node)
  { return masses[node].own < little_mass * masses[node].even; };
  for (Index c : field.part.cells)
    if (std::ranges::any_of(mesh.cells[c], has_little))
      integration.averaged_of_cell[c] = 0;
}

/// Averages the mean stresses of the cells over nodes, in each cell by the fraction that its soils have in
/// `integration.averaged_by_law`: the transpose of the average that strains are given, so that the forces do the work
/// of the particles' stresses on averaged strains.
template <class G, int D = G::dim>
void average_stress_of_soils(const Mesh<D>& mesh, NodeExchange& exchange, const std::vector<Run>& runs,
                             VelocityField<G>& field)
{
  if (!field.integration.given)
    find_averaged_fractions(mesh, exchange, runs, field);
  average_mean_stress<G>(mesh, exchange, field, [&](Index c) { return mean_of<G>(integrated_stress(mesh, field, c)); });
}
} // namespace

template <class G, int D>
void particles_to_nodes(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                        const std::vector<Run>& runs, VelocityField<G>& field)
{
  if (std::exchange(field.part_shrinks, false))
    shrink_part(mesh, exchange, field);
  begin_integration(mesh, exchange, particles, runs, field);
  CellIntegration<D>& integration = field.integration;
  if (!integration.given)
    integration.groups =
        averaged_groups(mesh, {runs, field.resting.runs}, integration.group_by_law, integration.groups.count);
  const auto integrated = [&](Index c) { return integrated_stress(mesh, field, c); };
  const auto scatter_particles = [&](auto&& stress_of, std::span<const NodeSums<D>> of_resting_cells)
  {
    field.has_light_nodes = scatter<G>(mesh, exchange, part_of_particles(field), field.moments, stress_of,
                                       field.tractions, of_resting_cells, field.nodes,
                                       2 * field.least_mass); // twice: sums of several cells have round-off
  };
  if (has_averaged_forces(field.integration))
  {
    average_stress_of_soils(mesh, exchange, runs, field);
    const auto averaged = [&](Index c)
    {
      Working<G> stress = integrated(c);
      const double change = change_by_averaging(mesh, field, c);
      for (int k : normal_component<G>)
        stress[k] += change;
      return stress;
    };
    scatter_particles(averaged, {});
    add_resting_sums(mesh, averaged, field);
  }
  else if (field.integration.kind == Integration::particles)
    scatter_particles(integrated, field.resting.sums);
  else
  {
    scatter_particles(integrated, {});
    add_resting_sums(mesh, integrated, field);
  }
}

template <class G, int D>
Working<G> acting_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  Working<G> stress = field.moments[cell].stress;
  for (double& component : stress)
    component /= field.moments[cell].volume;
  if (has_averaged_forces(field.integration))
    for (int k : normal_component<G>)
      stress[k] += change_by_averaging(mesh, field, cell) / integrated_volume(mesh, field, cell);
  return stress;
}

namespace
{
/// What water that moves by itself gives to the nodes, and the forces on soil and water together of that which stands
/// over them; over all ranks.
/// @pre the soil has given its part, of this rank
/// @note Collective
template <class G>
void map_water_to_nodes(Model<G>& model)
{
  VelocityField<G>& soil = model.fields.front();
  WaterField<G>& water = model.water_field;
  water_to_nodes(model.mesh, model.exchange, model.particles, model.order.runs, *model.water, soil, water);
  add_surface_pressures(model.mesh, *model.water, &PressureCondition::held, water.motion);
  if (!model.water->standing.empty())
    for (const auto* runs : {&model.order.runs, &soil.resting.runs})
      for (auto* nodes : {&soil.nodes, &water.motion.nodes})
        add_standing_forces<G>(model.mesh, model.particles, *model.water, *runs, water.motion, *nodes);
  sum_shared(model.exchange, soil.nodes);
  sum_shared(model.exchange, water.motion.nodes);
  sum_shared(model.exchange, water.nodes);
  if (!model.water->anisotropy.empty())
    sum_shared(model.exchange, water.drag);
}
} // namespace

template <class G>
void map_to_nodes(Model<G>& model)
{
  for (VelocityField<G>& field : model.fields)
  {
    particles_to_nodes(model.mesh, model.exchange, model.particles, model.order.runs, field);
    if (model.water)
    {
      for (const auto* runs : {&model.order.runs, &field.resting.runs})
        add_pore_forces(model.mesh, model.particles, *model.water, *runs, field);
      add_surface_pressures(model.mesh, *model.water, &PressureCondition::presses, field);
    }
    if (!has_two_phases(model))
      sum_shared(model.exchange, field.nodes);
  }
  if (has_two_phases(model))
    map_water_to_nodes(model);
}

template <class G>
Vector<G::dim> mean_of_heavy_nodes(const Mesh<G::dim>& mesh, const VelocityField<G>& field,
                                   const std::vector<Vector<G::dim>>& nodal, Index cell)
{
  constexpr int D = G::dim;
  Vector<D> mean{};
  int heavy = 0;
  for (Index node : mesh.cells[cell])
    if (!is_light(field, node))
    {
      ++heavy;
      for (int a = 0; a < D; ++a)
        mean[a] += nodal[node][a];
    }
  for (double& component : mean)
    component /= std::max(heavy, 1);
  return mean;
}

template <class G>
void find_start_velocity(VelocityField<G>& field)
{
  field.per_mass.resize(field.nodes.size());
  for (Index i : field.part.nodes)
  {
    const NodeSums<G::dim>& node = field.nodes[i];
    const double per_mass = field.per_mass[i] = is_light(field, i) ? 0 : 1 / node.mass;
    for (int a = 0; a < G::dim; ++a)
      field.start_velocity[i][a] = node.momentum[a] * per_mass;
  }
  impose_supports<G>(field.start_velocity, field);
}

template <class G>
void find_velocity_change(VelocityField<G>& field, double pic_fraction, double dt)
{
  for (Index i : field.part.nodes)
    for (int a = 0; a < G::dim; ++a)
      field.velocity_change[i][a] = dt * field.acceleration[i][a] + pic_fraction * field.start_velocity[i][a];
}

template <class G, int D>
void average_strains(const Mesh<D>& mesh, NodeExchange& exchange, const std::vector<Vector<G::dim>>& nodal, double dt,
                     VelocityField<G>& field)
{
  field.integration.relaxing.clear();
  // Averages of stress have found the volumes, and left them side by side.
  const bool known = has_averaged_forces(field.integration) && !field.integration.strains_in_full;
  const auto volume_of = [&](Index c)
  { return known ? field.integration.mean_stress_of_cell[c].volume : averaged_strain_volume(mesh, field, c); };
  with_values_of_vertices(mesh, field,
                          [&](auto&& value_of)
                          {
                            const auto strain_of = [&](Index c, double volume)
                            {
                              double divergence = 0;
                              for (int k = 0; k <= D; ++k)
                              {
                                const Vector<D>& v = value_of(nodal, c, k);
                                divergence += dot<D>(v, mesh.shapes[c].gradient[k]);
                                if constexpr (G::has_hoop)
                                  divergence += v[0] * hoop_gradient<G>(mesh.shapes[c]);
                              }
                              return dt * divergence * volume;
                            };
                            average_over_nodes(mesh, field.part, field.integration.groups, volume_of, strain_of,
                                               exchange, field.volumetric_strain);
                          });
}

template <class G, int D>
void average_stresses(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field,
                      std::span<Working<G>> stress)
{
  average_mean_stress<G>(mesh, exchange, field, [&](Index c) { return mean_of<G>(stress[c]); });
  for (Index c : field.part.cells)
  {
    if (field.integration.mean_stress_of_cell[c].volume == 0)
      continue;
    const double change = change_by_averaging(mesh, field, c);
    for (int k : normal_component<G>)
      stress[c][k] += change;
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void particles_to_nodes(const Mesh<G::dim>&, NodeExchange&, const Particles<G::dim>&,                       \
                                   const std::vector<Run>&, VelocityField<G>&);                                        \
  template Working<G> acting_stress(const Mesh<G::dim>&, const VelocityField<G>&, Index);                              \
  template void map_to_nodes(Model<G>&);                                                                               \
  template Vector<G::dim> mean_of_heavy_nodes(const Mesh<G::dim>&, const VelocityField<G>&,                            \
                                              const std::vector<Vector<G::dim>>&, Index);                              \
  template void find_start_velocity(VelocityField<G>&);                                                                \
  template void find_velocity_change(VelocityField<G>&, double, double);                                               \
  template void average_strains(const Mesh<G::dim>&, NodeExchange&, const std::vector<Vector<G::dim>>&, double,        \
                                VelocityField<G>&);                                                                    \
  template void average_stresses(const Mesh<G::dim>&, NodeExchange&, VelocityField<G>&, std::span<Working<G>>);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
