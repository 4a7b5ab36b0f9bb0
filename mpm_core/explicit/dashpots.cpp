#include "explicit/dashpots.h"

#include "model/absorbing.h"
#include "model/contact_pair.h"
#include "model/mapping.h"
#include "model/resting_nodes.h"

#include <algorithm>

namespace mpm::explicit_scheme
{
namespace
{
/// The part of the mesh with nodes of dashpots, but for resting cells
template <class G>
MeshPart part_beside(const Mesh<G::dim>& mesh, std::span<const DashpotNode<G::dim>> dashpots, VelocityField<G>& field)
{
  std::vector<Index> nodes, cells;
  for (const DashpotNode<G::dim>& entry : dashpots)
    nodes.push_back(entry.node);
  const auto is_beside = [&](Index cell) {
    return std::ranges::any_of(mesh.cells[cell], [&](Index node) { return std::ranges::binary_search(nodes, node); });
  };
  std::ranges::copy_if(part_of_particles(field).cells, std::back_inserter(cells), is_beside);
  return make_part<G::dim>(mesh, cells, nodes);
}

/// Momentum that the particles of a field gain at the nodes of dashpots by changes of nodal velocities.
template <class G>
void gained_momentum(Model<G>& model, const VelocityField<G>& field, std::span<const Vector<G::dim>> change,
                     std::span<Vector<G::dim>> momentum)
{
  scatter_momentum<G>(model.mesh, model.exchange, field.beside_dashpots, field.moments, change, momentum);
  add_resting_momentum<G>(field, change, field.beside_dashpots, momentum);
  sum_shared(model.exchange, momentum);
}

/// The same of soil and water, added to sums.
template <class G>
void add_gained_momentum(Model<G>& model, const VelocityField<G>& soil, const VelocityField<G>* water,
                         std::span<const Vector<G::dim>> change, std::span<Vector<G::dim>> sums)
{
  std::vector<Vector<G::dim>> momentum(sums.size());
  for (const VelocityField<G>* phase : {&soil, water})
  {
    if (!phase)
      continue;
    gained_momentum<G>(model, *phase, change, momentum);
    for (Index i : phase->beside_dashpots.nodes)
      for (int a = 0; a < G::dim; ++a)
        sums[i][a] += momentum[i][a];
  }
}

/// Velocity of the particles at the nodes of dashpots after the step by the present velocity changes.
template <class G>
void find_velocity_at_dashpots(Model<G>& model, double flip_fraction, std::span<const DashpotNode<G::dim>> dashpots,
                               VelocityField<G>& field)
{
  gained_momentum<G>(model, field, field.velocity_change, field.velocity);
  Index last = none;
  for (const DashpotNode<G::dim>& entry : dashpots)
  {
    const Index i = entry.node;
    if (i == last)
      continue;
    last = i;
    for (int a = 0; a < G::dim; ++a)
      field.velocity[i][a] = (flip_fraction * field.nodes[i].momentum[a] + field.velocity[i][a]) * field.per_mass[i];
    if (const Support<G::dim>* support = support_of(field, i))
      impose<G::dim>(*support, field.velocity[i]);
  }
}
} // namespace

template <class G>
void prepare_dashpots(Model<G>& model)
{
  constexpr int D = G::dim;
  VelocityField<G>& field = model.fields.front();
  VelocityField<G>* const water = has_two_phases(model) ? &model.water_field.motion : nullptr;
  field.beside_dashpots = part_beside<G>(model.mesh, field.dashpots, field);
  if (water)
    water->beside_dashpots = part_beside<G>(model.mesh, field.dashpots, *water);
  Vector<D> one{};
  one[0] = 1;
  const std::size_t nodes = model.mesh.points.size();
  std::vector<Vector<D>> mass(nodes), acceleration(nodes), gained(nodes);
  add_gained_momentum<G>(model, field, water, std::vector<Vector<D>>(nodes, one), mass);
  for (const DashpotNode<D>& entry : field.dashpots)
    if (mass[entry.node][0] > 0) // some soil is there
      acceleration[entry.node][0] += entry.area / mass[entry.node][0];
  add_gained_momentum<G>(model, field, water, acceleration, gained);
  for (DashpotNode<D>& entry : field.dashpots)
  {
    const double alone = mass[entry.node][0] * acceleration[entry.node][0];
    entry.response = alone > 0 ? gained[entry.node][0] / alone : 1;
  }
}

template <class G>
void add_dashpots(Model<G>& model, double pic_fraction, double dt, VelocityField<G>& field, VelocityField<G>* water)
{
  find_velocity_at_dashpots<G>(model, 1 - pic_fraction, field.dashpots, field);
  if (water)
    find_velocity_at_dashpots<G>(model, 1 - pic_fraction, field.dashpots, *water);
  add_dashpot_forces(model.mesh, model.time, dt, true, field, water);
}

template <class G>
void keep_driven_velocity(std::span<const DashpotNode<G::dim>> dashpots, double dt, VelocityField<G>& field)
{
  for (const DashpotNode<G::dim>& entry : dashpots)
    if (const Index i = entry.node; entry.is_rigid && !is_light(field, i))
      for (int a = 0; a < G::dim; ++a)
        field.velocity[i][a] = field.start_velocity[i][a] + dt * field.acceleration[i][a];
}

#define INSTANTIATE(G)                                                                                                 \
  template void prepare_dashpots(Model<G>&);                                                                           \
  template void add_dashpots(Model<G>&, double, double, VelocityField<G>&, VelocityField<G>*);                         \
  template void keep_driven_velocity(std::span<const DashpotNode<G::dim>>, double, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
