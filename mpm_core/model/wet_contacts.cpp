#include "model/wet_contacts.h"

#include "model/mapping.h"
#include "model/pore_forces.h"
#include "model/water_boundary.h"

#include <algorithm>
#include <map>
#include <utility>

namespace mpm::model
{
namespace
{
/// Pore pressure without that of water that stands over the soil, and then effective stress, of the cells around a
/// node: sums of both times the volumes of their soil.
template <int D>
using StressAround = std::array<double, 1 + n_symmetric<D>>;

/// These sums of all nodes, over all ranks.
/// @note Collective
template <class G, int D = G::dim>
std::vector<StressAround<D>> stress_around(Model<G>& model)
{
  const VelocityField<G>& soil = model.fields.front();
  std::vector<StressAround<D>> nodes(soil.nodes.size(), StressAround<D>{});
  for (Index c : soil.part.cells)
  {
    const double volume = soil.moments[c].volume;
    if (volume == 0)
      continue;
    const CellShape<D>& shape = model.mesh.shapes[c];
    const auto standing = standing_water(model.mesh, *model.water, c);
    const Working<G> of_water = acting_stress(model.mesh, model.water_field.motion, c);
    const Working<G> of_soil = acting_stress(model.mesh, soil, c);
    const double pressure = -of_water[0] - pressure_at<D>(standing, shape_functions<D>(shape, shape.centre));
    for (Index node : model.mesh.cells[c])
    {
      nodes[node][0] += volume * pressure;
      for (int k = 0; k < n_symmetric<D>; ++k)
        nodes[node][1 + k] += volume * of_soil[k];
    }
  }
  sum_shared(model.exchange, nodes);
  return nodes;
}

/// Fraction of the normal stress on a surface that the water of a cell carries, without that which stands over the
/// soil.
template <int D>
double water_fraction(const std::array<Index, D + 1>& cell, const std::vector<StressAround<D>>& nodes,
                      const Vector<D>& normal)
{
  double water = 0, grains = 0;
  for (Index node : cell)
  {
    water += nodes[node][0];
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b)
        grains -= normal[a] * nodes[node][1 + symmetric_index<D>(a, b)] * normal[b];
  }
  grains = std::max(grains, 0.0); // none where the soil is in tension
  return water + grains > 0 ? std::clamp(water / (water + grains), 0.0, 1.0) : 0;
}

/// Directions along which nodes are impervious.
template <int D>
using Closed = std::map<Index, ImperviousNode<D>>;

/// Adds the normals of the nodes at the surface of the soil that a rigid surface covers.
/// @param facing  see `contact::WaterBeside`; this sets it to zero
template <class G, int D = G::dim>
void close_covered(const WaterField<G>& water, const std::vector<Index>& filled, std::vector<Vector<D>>& facing,
                   Closed<D>& closed)
{
  for (Index i : filled)
  {
    Vector<D> normal = std::exchange(facing[i], {});
    const double area = norm<D>(normal);
    if (area == 0 || !is_at_surface<D>(water.nodes[i]))
      continue;
    for (double& component : normal)
      component /= area;
    ImperviousNode<D>& node = closed[i];
    node.node = i;
    add_direction<D>(normal, node);
  }
}
} // namespace

template <class G>
void add_wet_contact_forces(Model<G>& model, double dt)
{
  constexpr int D = G::dim;
  if (model.contacts.empty())
    return;
  VelocityField<G>& soil = model.fields.front();
  WaterField<G>& water = model.water_field;
  const auto around = stress_around<G, D>(model);
  const auto fraction = [&](Index cell, const Vector<D>& normal)
  { return water_fraction<D>(model.mesh.cells[cell], around, normal); };
  const Movers movers{model.field_of_law, 0};
  for (auto* forces : {&soil.contact_force, &water.motion.contact_force, &water.covered})
    forces->resize(soil.nodes.size());
  const WaterBeside<D> beside{fraction, water.motion.contact_force, water.covered};
  Closed<D> closed;
  for (const ImperviousNode<D>& node : water.impervious)
    closed[node.node] = node;
  for (auto& contact : model.contacts)
  {
    add_contact_forces<G, D>(model.mesh, model.order.runs, movers, soil.start_velocity, dt, model.particles, contact,
                             soil.contact_force, &beside);
    sum_shared(model.exchange, water.covered);
    close_covered<G, D>(water, soil.part.nodes, water.covered, closed);
  }
  water.closed.clear();
  for (const auto& [node, impervious] : closed)
    water.closed.push_back(impervious);
  for (VelocityField<G>* phase : {&soil, &water.motion})
  {
    sum_shared(model.exchange, phase->contact_force);
    for (Index i : soil.part.nodes)
    {
      for (int a = 0; a < D; ++a)
        phase->nodes[i].traction[a] += phase->contact_force[i][a];
      phase->contact_force[i] = {};
    }
  }
}

#define INSTANTIATE(G) template void add_wet_contact_forces(Model<G>&, double);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
