#include "model/absorbing.h"

#include "base/eigen.h"
#include "base/tensor.h"
#include "model/contact_pair.h"
#include "model/mapping.h"
#include "model/material_points.h"
#include "parallel/agreement.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

namespace mpm::model
{
namespace
{
/// Dashpot and spring of a node, as plain doubles: one message for nodes that ranks share.
template <int D>
struct NodeOfSide
{
  Matrix<D> damping;
  Matrix<D> stiffness;
  double area;     ///< above zero for nodes on the side
  double is_rigid; ///< above zero where it is
};

/// Soil of a cell as waves see it: undrained where there is pore water.
struct CellSoil
{
  WaveModuli moduli;
  double density; ///< with the water [kg/m3]
};

/// K_w / n of the particles of a run [Pa]; of incompressible water that explicit runs refuse, none.
template <class G>
double water_stiffness(const Model<G>& model, const Run& run)
{
  double volume = 0, pores = 0;
  for (Index p = run.first; model.water && p < run.last; ++p)
  {
    volume += model.particles.volume[p];
    pores += model.particles.volume[p] * model.particles.porosity[0][p];
  }
  return pores > 0 && std::isfinite(model.water->modulus) ? model.water->modulus * volume / pores : 0;
}

/// That of each owned cell, where there is some.
template <class G, int D = G::dim>
std::vector<std::optional<CellSoil>> soil_of_cells(const Model<G>& model)
{
  std::vector<std::optional<CellSoil>> soil(static_cast<std::size_t>(model.mesh.owned_cells));
  const bool two_phases = has_two_phases(model);
  for (const MaterialPoints<D>& points : {material_points(model), resting_points(model)})
    for (const Run& run : points.runs)
    {
      const CellMoments<G>& moments = model.fields.front().moments[run.cell];
      const double mass = moments.mass + (two_phases ? model.water_field.motion.moments[run.cell].mass : 0);
      WaveModuli moduli = mean_moduli(points, run);
      moduli.p_wave += water_stiffness(model, run);
      soil[static_cast<std::size_t>(run.cell)] = CellSoil{moduli, mass / moments.volume};
    }
  return soil;
}

/// Adds the facet of a cell opposite to vertex k: its vertices have equal parts of its area.
template <int D>
void add_facet(const Mesh<D>& mesh, const AbsorbingSide& side, Index cell, int k, const CellSoil& soil,
               std::vector<NodeOfSide<D>>& nodes)
{
  const CellShape<D>& shape = mesh.shapes[cell];
  const double size = norm<D>(shape.gradient[k]), area = size * shape.volume; // D V |grad N_k| over D vertices
  const double moduli[]{soil.moduli.p_wave, soil.moduli.shear};
  const double given[]{side.normal_impedance, side.shear_impedance};
  const bool is_rigid = std::isinf(side.normal_impedance);
  std::array<double, 2> damping{}, stiffness{};
  for (int s = 0; s < 2 && !is_rigid; ++s)
  {
    damping[s] = area * (given[s] > 0 ? given[s] : std::sqrt(soil.density * moduli[s]));
    stiffness[s] = area * moduli[s] / side.thickness;
  }
  for (Index node : facet_nodes<D>(mesh.cells[cell], k))
  {
    nodes[node].area += area;
    nodes[node].is_rigid += is_rigid ? 1 : 0;
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
      {
        const double normal = shape.gradient[k][i] * shape.gradient[k][j] / (size * size);
        const double along = (i == j ? 1.0 : 0.0) - normal;
        nodes[node].damping[i][j] += damping[0] * normal + damping[1] * along;
        nodes[node].stiffness[i][j] += stiffness[0] * normal + stiffness[1] * along;
      }
  }
}

/// @returns number of facets of soil on the side, of this rank
template <class G, int D = G::dim>
int add_side(const Model<G>& model, const AbsorbingSide& side, std::span<const std::optional<CellSoil>> soil,
             std::vector<NodeOfSide<D>>& nodes)
{
  int facets = 0;
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    for (int k = 0; k <= D; ++k)
      if (const auto& of_cell = soil[static_cast<std::size_t>(c)];
          of_cell && model.mesh.facet_tags[c][k] == side.facet_tag)
      {
        add_facet<D>(model.mesh, side, c, k, *of_cell, nodes);
        ++facets;
      }
  return facets;
}

/// Adds entries for the nodes of the sides beside one free field, or of those of the incoming wave.
/// @throws InputError on all ranks: a side without soil
/// @note Collective
template <class G, int D = G::dim>
void add_entries(Model<G>& model, std::span<const AbsorbingSide> sides, Index free_field,
                 std::span<const std::optional<CellSoil>> soil)
{
  std::vector<NodeOfSide<D>> nodes(model.mesh.points.size(), NodeOfSide<D>{});
  for (const AbsorbingSide& side : sides)
  {
    if (side.free_field != free_field)
      continue;
    int facets = add_side<G>(model, side, soil, nodes);
    MPI_Allreduce(MPI_IN_PLACE, &facets, 1, MPI_INT, MPI_SUM, model.exchange.comm);
    if (facets == 0)
      throw InputError("facet_tag " + std::to_string(side.facet_tag) +
                       " has no soil at its facets, expected particles in the cells at a side that absorbs");
  }
  sum_shared(model.exchange, nodes);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].area > 0)
      model.fields.front().dashpots.push_back({static_cast<Index>(i),
                                               nodes[i].damping,
                                               nodes[i].stiffness,
                                               {},
                                               {},
                                               free_field,
                                               nodes[i].area,
                                               nodes[i].is_rigid > 0});
}

/// The entries of each node in turn, which follow one another.
template <int D, class Visit>
void for_each_node(std::span<DashpotNode<D>> entries, Visit&& visit)
{
  for (std::size_t first = 0, last = 0; first < entries.size(); first = last)
  {
    while (last < entries.size() && entries[last].node == entries[first].node)
      ++last;
    visit(entries.subspan(first, last - first));
  }
}

/// The ground on the other ends of dashpots.
template <class G, int D = G::dim>
class Beside
{
public:
  Beside(const Mesh<D>& mesh, const VelocityField<G>& field, double time)
      : _mesh(mesh), _field(field), _incoming(field.incoming.at(time))
  {
    for (const FreeField<D>& ground : field.free_fields)
      _states.push_back(ground.at(time));
  }
  typename FreeField<D>::State at(const DashpotNode<D>& entry) const
  {
    typename FreeField<D>::State state{};
    if (entry.free_field == none)
      for (int a = 0; a < D; ++a)
        state.velocity[a] = 2 * _incoming[a];
    else if (const auto number = static_cast<std::size_t>(entry.free_field); number < _states.size())
    {
      const auto [k, part] = bracket(_field.free_fields[number].heights, _mesh.points[entry.node][D - 1]);
      state = FreeField<D>::between(_states[number][k], _states[number][k + 1], part);
    }
    return state;
  }

private:
  const Mesh<D>& _mesh;
  const VelocityField<G>& _field;
  Vector<D> _incoming;
  std::vector<std::vector<typename FreeField<D>::State>> _states; ///< at the heights of each free field
};

/// Mean of velocities of soil and water at a node, by their masses.
/// @param velocity  the member of both fields that is meant
template <class G, int D = G::dim>
Vector<D> velocity_of_both(const VelocityField<G>& soil, const VelocityField<G>* water, Index i,
                           std::vector<Vector<G::dim>> VelocityField<G>::*velocity)
{
  Vector<D> mean = (soil.*velocity)[i];
  if (!water || is_light(*water, i))
    return mean;
  const double part = water->nodes[i].mass / (soil.nodes[i].mass + water->nodes[i].mass);
  for (int a = 0; a < D; ++a)
    mean[a] += part * ((water->*velocity)[i][a] - mean[a]);
  return mean;
}

/// What moves at a node, and the force on it but for dashpots: the soil, and its water where that moves by itself.
template <int D>
struct MovingNode
{
  double mass;
  Vector<D> velocity; ///< at the step's start
  Vector<D> residual; ///< [N]
};

template <class G, int D = G::dim>
MovingNode<D> moving_node(const VelocityField<G>& field, const VelocityField<G>* water, Index i,
                          const Vector<G::dim>& gravity)
{
  MovingNode<D> node{field.nodes[i].mass, velocity_of_both(field, water, i, &VelocityField<G>::start_velocity),
                     unbalanced_force<D>(field.nodes[i], gravity)};
  if (!water)
    return node;
  const double of_water = is_light(*water, i) ? 0 : water->nodes[i].mass;
  for (int a = 0; a < D; ++a)
    node.residual[a] += of_water * gravity[a] - water->nodes[i].internal[a];
  node.mass += of_water;
  return node;
}

/// Gives the nodes of driven sides the velocity of the ground, as boundary conditions do.
template <class G>
void drive_nodes(const Beside<G>& beside, VelocityField<G>& field, VelocityField<G>* water)
{
  for (const DashpotNode<G::dim>& entry : field.dashpots)
    if (entry.is_rigid)
      for (VelocityField<G>* phase : {&field, water})
        if (phase && !is_light(*phase, entry.node))
          phase->start_velocity[entry.node] = beside.at(entry).velocity;
}

/// held + A t - K u over the entries of a node; on a driven side what makes m a of its motion with a residual.
template <class G, int D = G::dim>
Vector<D> force_of_ground(std::span<const DashpotNode<D>> entries, const Beside<G>& beside, double dt,
                          const MovingNode<D>& node)
{
  Vector<D> force{};
  for (const DashpotNode<D>& entry : entries)
  {
    const auto ground = beside.at(entry);
    if (entry.is_rigid)
    {
      for (int a = 0; a < D; ++a)
        force[a] = node.mass * (ground.velocity[a] - node.velocity[a]) / dt - node.residual[a];
      return force;
    }
    const Vector<D> spring = product<D>(entry.stiffness, entry.displacement);
    for (int a = 0; a < D; ++a)
      force[a] += entry.held[a] + entry.area * ground.traction[a] - spring[a];
  }
  return force;
}

/// The acceleration that dashpots give to a node: (m + k dt C / 2) a = sum over entries of C (v_beside - v).
/// @param v  mean velocity at the node over the step, without dashpots
/// @param k  part of a by which that velocity changes
template <class G, int D = G::dim>
Vector<D> acceleration_by_dashpots(std::span<const DashpotNode<D>> entries, const Beside<G>& beside, double dt,
                                   double mass, double k, const Vector<D>& v)
{
  Eigen::Matrix<double, D, D> inertia = mass * Eigen::Matrix<double, D, D>::Identity();
  Eigen::Matrix<double, D, 1> force = Eigen::Matrix<double, D, 1>::Zero();
  for (const DashpotNode<D>& entry : entries)
  {
    const auto damping = as_eigen<D>(entry.damping);
    const Vector<D> against = difference<D>(beside.at(entry).velocity, v);
    inertia += 0.5 * k * dt * damping;
    force += damping * Eigen::Map<const Eigen::Matrix<double, D, 1>>(against.data());
  }
  const Eigen::Matrix<double, D, 1> solution = inertia.inverse() * force;
  Vector<D> found;
  std::copy_n(solution.data(), D, found.begin());
  return found;
}
} // namespace

template <class G>
void set_absorbing_sides(Model<G>& model, std::span<const AbsorbingSide> sides, const Vector<G::dim>& gravity)
{
  constexpr int D = G::dim;
  VelocityField<G>& field = model.fields.front();
  if (G::has_hoop || model.fields.size() > 1)
    throw InputError(
        "absorbing sides are not supported in axial symmetry or with several velocity fields, expected plane strain "
        "or three dimensions and one field");
  prepare(model);
  map_to_nodes(model);
  const std::vector<std::optional<CellSoil>> soil = soil_of_cells(model);
  std::set<Index> free_fields;
  for (const AbsorbingSide& side : sides)
    free_fields.insert(side.free_field);
  field.dashpots.clear();
  for (Index free_field : free_fields)
    add_entries<G>(model, sides, free_field, soil);
  const VelocityField<G>* water = has_two_phases(model) ? &model.water_field.motion : nullptr;
  std::ranges::stable_sort(field.dashpots, {}, &DashpotNode<D>::node);
  for_each_node<D>(field.dashpots,
                   [&](std::span<DashpotNode<D>> entries)
                   {
                     const MovingNode<D> node = moving_node(field, water, entries[0].node, gravity);
                     for (int a = 0; a < D; ++a)
                       entries[0].held[a] = -node.residual[a];
                   });
}

template <class G>
void add_forces_of_ground(const Mesh<G::dim>& mesh, const Vector<G::dim>& gravity, double time, double dt,
                          VelocityField<G>& field, VelocityField<G>* water)
{
  constexpr int D = G::dim;
  drive_nodes(Beside<G>(mesh, field, time - 0.5 * dt), field, water);
  const Beside<G> beside(mesh, field, time + 0.5 * dt);
  for_each_node<D>(field.dashpots,
                   [&](std::span<const DashpotNode<D>> entries)
                   {
                     const Index i = entries[0].node;
                     if (is_light(field, i))
                       return;
                     const Vector<D> force =
                         force_of_ground<G, D>(entries, beside, dt, moving_node(field, water, i, gravity));
                     for (int a = 0; a < D; ++a)
                       field.nodes[i].traction[a] += force[a];
                   });
}

template <class G>
void add_dashpot_forces(const Mesh<G::dim>& mesh, double time, double dt, bool shared, VelocityField<G>& field,
                        VelocityField<G>* water)
{
  constexpr int D = G::dim;
  const Beside<G> beside(mesh, field, time + 0.5 * dt);
  const auto add_to_node = [&](std::span<const DashpotNode<D>> entries)
  {
    const Index i = entries[0].node;
    if (is_light(field, i) || entries[0].is_rigid)
      return;
    const double of_soil = field.nodes[i].mass, of_water = water && !is_light(*water, i) ? water->nodes[i].mass : 0;
    const double mass = of_soil + of_water;
    const Vector<D> start = velocity_of_both(field, water, i, &VelocityField<G>::start_velocity);
    const Vector<D> end = velocity_of_both(field, water, i, &VelocityField<G>::velocity);
    Vector<D> mean;
    for (int a = 0; a < D; ++a)
      mean[a] = 0.5 * (start[a] + end[a]);
    const double k = shared ? entries[0].response : 1;
    Vector<D> gained = acceleration_by_dashpots<G, D>(entries, beside, dt, mass, k, mean);
    if (const Support<D>* support = support_of(field, i))
      take_out_supported<D>(*support, gained);
    for (int a = 0; a < D; ++a)
    {
      field.nodes[i].traction[a] += mass * gained[a];
      field.acceleration[i][a] += gained[a];
      if (of_water > 0)
        water->acceleration[i][a] += gained[a];
    }
  };
  for_each_node<D>(field.dashpots, add_to_node);
}

template <class G>
void move_springs(const Mesh<G::dim>& mesh, double time, double dt, VelocityField<G>& field,
                  const VelocityField<G>* water)
{
  constexpr int D = G::dim;
  const Beside<G> beside(mesh, field, time);
  for (auto& entry : field.dashpots)
  {
    // a wave that goes by moves the springs; a free field takes them along
    const auto ground = entry.free_field == none ? typename FreeField<D>::State{} : beside.at(entry);
    const Index i = entry.node;
    const Vector<D> velocity = velocity_of_both(field, water, i, &VelocityField<G>::velocity);
    for (int a = 0; a < D; ++a)
      entry.displacement[a] += dt * (velocity[a] - ground.velocity[a]);
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void set_absorbing_sides(Model<G>&, std::span<const AbsorbingSide>, const Vector<G::dim>&);                 \
  template void add_forces_of_ground(const Mesh<G::dim>&, const Vector<G::dim>&, double, double, VelocityField<G>&,    \
                                     VelocityField<G>*);                                                               \
  template void add_dashpot_forces(const Mesh<G::dim>&, double, double, bool, VelocityField<G>&, VelocityField<G>*);   \
  template void move_springs(const Mesh<G::dim>&, double, double, VelocityField<G>&, const VelocityField<G>*);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
