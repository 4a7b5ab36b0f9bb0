#include "model/members.h"

#include "mesh/search.h"
#include "model/bond.h"
#include "model/mapping.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace mpm::model
{
namespace
{
/// A segment as it is now.
template <int D>
struct Segment
{
  Vector<D> along; ///< unit vector
  double length;   ///< [m]
};

template <int D>
Segment<D> segment_of(const Member<D>& member, std::size_t k)
{
  Vector<D> edge;
  for (int a = 0; a < D; ++a)
    edge[a] = member.positions[k + 1][a] - member.positions[k][a];
  const double length = norm<D>(edge);
  for (double& component : edge)
    component /= length;
  return {edge, length};
}

/// The angle from one direction to another, counterclockwise.
double angle_between(const Vector<2>& from, const Vector<2>& to)
{
  return std::atan2(from[0] * to[1] - from[1] * to[0], dot<2>(from, to));
}

/// Length over which the curvature at inner node k + 1 acts.
template <int D>
double length_of_bend(const Member<D>& member, std::size_t k)
{
  return 0.5 * (member.initial_lengths[k] + member.initial_lengths[k + 1]);
}

/// Whether nodes k to last are in soil: a part that hangs in the air carries nothing.
template <int D>
bool carries(const Member<D>& member, std::size_t first, std::size_t last)
{
  for (std::size_t k = first; k <= last; ++k)
    if (!member.is_in_soil[k])
      return false;
  return true;
}

/// Largest force between a node and the soil: over half of the segments beside it.
template <int D>
double bond_strength_at(const Member<D>& member, std::size_t node)
{
  const std::size_t segments = member.initial_lengths.size();
  const bool is_tied = (node == 0 && member.properties.connected) || (node == segments && member.properties.fixed_end);
  if (is_tied)
    return std::numeric_limits<double>::infinity();
  const std::size_t first = member.properties.has_free_length ? 1 : 0;
  const double before = node > first ? member.initial_lengths[node - 1] : 0;
  const double after = node >= first && node < segments ? member.initial_lengths[node] : 0;
  return member.properties.bond_strength * 0.5 * (before + after);
}

/// Updates the axial forces to the present lengths of the segments, within their strength and that of the bond.
template <int D>
void strain_segments(Member<D>& member, const std::vector<Segment<D>>& now)
{
  const MemberProperties& of = member.properties;
  BondedBar bar;
  for (std::size_t k = 0; k < now.size(); ++k)
  {
    const bool is_whole = carries<D>(member, k, k + 1);
    bar.stiffness.push_back(of.axial_stiffness / member.initial_lengths[k]);
    bar.force.push_back(bar.stiffness[k] * (now[k].length - member.free_lengths[k]));
    bar.least.push_back(is_whole ? -of.compressive_strength : 0);
    bar.largest.push_back(is_whole ? of.tensile_strength : 0);
  }
  if (std::isfinite(of.bond_strength))
  {
    for (std::size_t n = 0; n <= now.size(); ++n)
      bar.bond_strength.push_back(bond_strength_at<D>(member, n));
    member.axial_force = forces_with_slip(bar);
  }
  else
    for (std::size_t k = 0; k < now.size(); ++k)
      member.axial_force[k] = std::clamp(bar.force[k], bar.least[k], bar.largest[k]);
  for (std::size_t k = 0; k < now.size(); ++k)
    if (member.axial_force[k] != bar.force[k])
      member.free_lengths[k] = now[k].length - member.axial_force[k] / bar.stiffness[k];
}

/// Adds the internal forces of the moment at inner node k + 1: M times the derivatives of the angle there.
void bend_node(Member<2>& member, std::size_t k, std::vector<Vector<2>>& internal)
{
  const MemberProperties& of = member.properties;
  const Segment<2> before = segment_of(member, k), after = segment_of<2>(member, k + 1);
  const double stiffness = of.bending_stiffness / length_of_bend<2>(member, k);
  const double angle = angle_between(before.along, after.along);
  const double elastic = stiffness * (angle - member.free_angles[k]);
  const double moment = carries(member, k, k + 2) ? std::clamp(elastic, -of.plastic_moment, of.plastic_moment) : 0;
  if (moment != elastic)
    member.free_angles[k] = angle - moment / stiffness;
  member.moments[k] = moment;
  const auto turn = [&](const Segment<2>& segment, std::size_t first, double sign)
  {
    const Vector<2> across{-segment.along[1], segment.along[0]};
    for (int a = 0; a < 2; ++a)
    {
      const double force = sign * moment * across[a] / segment.length;
      internal[first][a] -= force;
      internal[first + 1][a] += force;
    }
  };
  turn(after, k + 1, 1);
  turn(before, k, -1);
}

/// Internal forces of the nodes, with the axial forces and moments of the present positions.
template <int D>
std::vector<Vector<D>> internal_forces(Member<D>& member)
{
  std::vector<Vector<D>> internal(member.positions.size());
  std::vector<Segment<D>> now;
  for (std::size_t k = 0; k + 1 < member.positions.size(); ++k)
    now.push_back(segment_of<D>(member, k));
  strain_segments<D>(member, now);
  for (std::size_t k = 0; k < now.size(); ++k)
    for (int a = 0; a < D; ++a)
    {
      internal[k][a] -= member.axial_force[k] * now[k].along[a];
      internal[k + 1][a] += member.axial_force[k] * now[k].along[a];
    }
  if constexpr (D == 2)
    for (std::size_t k = 0; k < member.moments.size(); ++k)
      bend_node(member, k, internal);
  return internal;
}

/// Sum of the weights of a node before they are made parts of it, below which it counts as not in soil.
constexpr double least_filling = 0.05;

/// Density at the nodes of a cell over that of the particles, below which nothing in the cell counts as in soil: single
/// particles in the air neither carry a member nor shorten its steps.
constexpr double least_density = 0.1;

/// How far outside of the mesh a node may be, in shape functions of its last cell: by round-off a node at its boundary
/// is.
constexpr double most_outside = 0.5;

/// Finds the weights of the nodes of a cell, from the shape functions at a point of it and the densities of the soil at
/// its nodes relative to the largest of them; returns that density times the sum of what the weights are parts of.
template <class G>
double weigh(const Model<G>& model, const VelocityField<G>& field, const Vector<G::dim>& x, MemberHost<G::dim>& host)
{
  constexpr int D = G::dim;
  const auto shapes = shape_functions<D>(model.mesh.shapes[host.cell], x);
  std::array<double, D + 1> densities{};
  for (int k = 0; k <= D; ++k)
  {
    const Index node = model.mesh.cells[host.cell][k];
    if (field.part.has_node[node] && !is_light(field, node))
      densities[k] = field.nodes[node].mass / model.volume_around[static_cast<std::size_t>(node)];
  }
  const double largest = *std::ranges::max_element(densities);
  double sum = 0;
  for (int k = 0; k <= D; ++k)
  {
    host.weights[k] = largest > 0 ? std::max(0.0, shapes[k]) * densities[k] / largest : 0;
    sum += host.weights[k];
  }
  if (sum < least_filling || largest < least_density * model.largest_density)
    sum = 0;
  for (double& weight : host.weights)
    weight = sum > 0 ? weight / sum : 0;
  return largest * sum;
}

/// Largest density of a particle [kg/m^D].
/// @note Collective
template <class G>
double largest_density(const Model<G>& model)
{
  double largest = 0;
  for (Index p = 0; p < model.particles.size(); ++p)
    largest = std::max(largest, model.particles.mass[p] / model.particles.volume[p]);
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, model.exchange.comm);
  return largest;
}

/// Volumes of the cells around the nodes [m^D].
/// @note Collective
template <class G>
void find_volumes_around(Model<G>& model)
{
  const auto& mesh = model.mesh;
  model.volume_around.assign(mesh.points.size(), 0);
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (const Index node : mesh.cells[c])
      model.volume_around[static_cast<std::size_t>(node)] += mesh.shapes[c].volume / (G::dim + 1);
  sum_shared(model.exchange, model.volume_around);
}

/// Number on this rank of a cell that it owns; `none` of others.
template <class G>
Index own_number(const Model<G>& model, GlobalIndex cell)
{
  const auto found = model.migration.owned_cells.find(cell);
  return found == model.migration.owned_cells.end() ? none : found->second;
}

/// Cell of each node, by its number over all ranks: its last one where it has left the mesh by a little; `none` where
/// it is outside.
/// @note Collective
template <class G, int D = G::dim>
std::vector<GlobalIndex> cells_of_nodes(const Model<G>& model, const Member<D>& member)
{
  std::vector<GlobalIndex> cells(member.positions.size(), none);
  for (std::size_t k = 0; k < cells.size(); ++k)
  {
    const Vector<D>& x = member.positions[k];
    if (const Index cell = find_cell_in_bins<D>(model.mesh, x); cell != none)
      cells[k] = model.mesh.global_cells[cell];
  }
  const auto count = static_cast<int>(cells.size());
  MPI_Allreduce(MPI_IN_PLACE, cells.data(), count, MPI_INT64_T, MPI_MAX, model.exchange.comm);
  for (std::size_t k = 0; k < cells.size(); ++k)
  {
    const Index last = cells[k] == none ? own_number(model, member.cells[k]) : none;
    if (last == none)
      continue;
    const auto shapes = shape_functions<D>(model.mesh.shapes[last], member.positions[k]);
    if (*std::ranges::min_element(shapes) > -most_outside)
      cells[k] = member.cells[k];
  }
  MPI_Allreduce(MPI_IN_PLACE, cells.data(), count, MPI_INT64_T, MPI_MAX, model.exchange.comm);
  return cells;
}

/// How many nodes are moved by the soil: all but one that is held in space.
template <int D>
std::size_t moving_nodes(const Member<D>& member)
{
  return member.positions.size() - (member.properties.fixed_end ? 1 : 0);
}

/// What a rank knows of a node of a member, and what all sum up.
template <int D>
struct NodeMotion
{
  Vector<D> velocity;
  double in_soil;
  double left; ///< 1 where the node is about to leave its cell
};

/// The node that a node in no soil moves with: the nearest one along the member that is in soil, or itself.
template <int D>
std::size_t leader_of(const Member<D>& member, std::size_t k)
{
  const std::size_t n = moving_nodes(member);
  for (std::size_t apart = 0; apart < n; ++apart)
  {
    if (apart <= k && member.is_in_soil[k - apart])
      return k - apart;
    if (k + apart < n && member.is_in_soil[k + apart])
      return k + apart;
  }
  return k;
}
/// Finds the cells of the nodes of all members; one that has flowed out with the soil has none.
/// @throws RunError on all ranks, for a node outside of the mesh where soil may not flow out, or all must be inside
/// @note Collective
template <class G>
void find_hosts(Model<G>& model, bool all_inside)
{
  constexpr int D = G::dim;
  for (Member<D>& member : model.members)
  {
    member.cells = cells_of_nodes(model, member);
    for (std::size_t k = 0; k < moving_nodes(member); ++k)
    {
      if (member.cells[k] == none && (all_inside || model.outflow_tags.empty()))
      {
        std::ostringstream out;
        out << "node " << k << " of the structural member '" << member.name << "' at (";
        for (int a = 0; a < D; ++a)
          out << (a ? ", " : "") << member.positions[k][a];
        out << ") m is outside of the background mesh";
        throw RunError(out.str());
      }
      member.hosts[k].cell = own_number(model, member.cells[k]);
    }
  }
}
} // namespace

template <int D>
Member<D> make_member(std::string name, const MemberProperties& properties, std::vector<Vector<D>> positions,
                      std::vector<double> axial_force, std::vector<double> moments)
{
  Member<D> member{std::move(name),
                   properties,
                   std::move(positions),
                   {},
                   {},
                   {},
                   std::move(axial_force),
                   std::move(moments),
                   {},
                   {},
                   {}};
  const std::size_t segments = member.positions.size() - 1;
  for (std::size_t k = 0; k < segments; ++k)
  {
    const double length = segment_of<D>(member, k).length;
    member.initial_lengths.push_back(length);
    member.free_lengths.push_back(length * (1 - member.axial_force[k] / properties.axial_stiffness));
  }
  if constexpr (D == 2)
    for (std::size_t k = 0; k < member.moments.size(); ++k)
      member.free_angles.push_back(angle_between(segment_of<D>(member, k).along, segment_of<D>(member, k + 1).along) -
                                   member.moments[k] * length_of_bend<D>(member, k) / properties.bending_stiffness);
  member.is_in_soil.assign(member.positions.size(), 1);
  member.cells.assign(member.positions.size(), none);
  member.hosts.resize(member.positions.size());
  return member;
}

template <class G>
void begin_members(Model<G>& model, bool all_inside)
{
  if (model.members.empty())
    return;
  find_volumes_around(model);
  model.largest_density = largest_density(model);
  find_hosts(model, all_inside);
}

template <class G>
void add_member_forces(Model<G>& model, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  if (model.members.empty())
    return;
  std::vector<Vector<D>>& forces = field.contact_force;
  forces.resize(field.nodes.size());
  for (Member<D>& member : model.members)
  {
    const std::vector<Vector<D>> internal = internal_forces<D>(member);
    for (std::size_t n = 0; n < moving_nodes(member); ++n)
    {
      MemberHost<D>& host = member.hosts[n];
      if (host.cell == none)
        continue;
      weigh<G>(model, field, member.positions[n], host);
      for (int k = 0; k <= D; ++k)
        for (int a = 0; a < D; ++a)
          forces[model.mesh.cells[host.cell][k]][a] -= host.weights[k] * internal[n][a];
    }
  }
  sum_shared(model.exchange, forces);
  for (Index i : field.part.nodes)
    for (int a = 0; a < D; ++a)
      field.nodes[i].traction[a] += forces[i][a];
  std::ranges::fill(forces, Vector<D>{});
}

template <class G>
void move_members(Model<G>& model, double dt)
{
  constexpr int D = G::dim;
  if (model.members.empty())
    return;
  const VelocityField<G>& field = model.fields.front();
  std::vector<NodeMotion<D>> motions;
  for (Member<D>& member : model.members)
    for (std::size_t n = 0; n < moving_nodes(member); ++n)
    {
      NodeMotion<D> motion{};
      if (MemberHost<D>& host = member.hosts[n]; host.cell != none)
      {
        Vector<D> moved = member.positions[n];
        for (int k = 0; k <= D; ++k)
        {
          motion.in_soil += host.weights[k];
          for (int a = 0; a < D; ++a)
            motion.velocity[a] += host.weights[k] * field.velocity[model.mesh.cells[host.cell][k]][a];
        }
        for (int a = 0; a < D; ++a)
          moved[a] += dt * motion.velocity[a];
        const auto shapes = shape_functions<D>(model.mesh.shapes[host.cell], moved);
        motion.left = motion.in_soil > 0 && *std::ranges::min_element(shapes) < 0 ? 1 : 0;
      }
      motions.push_back(motion);
    }
  const auto count = static_cast<int>(motions.size()) * doubles_in<NodeMotion<D>>();
  MPI_Allreduce(MPI_IN_PLACE, motions.data(), count, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  bool any_left = false;
  auto of_member = motions.begin();
  for (Member<D>& member : model.members)
  {
    const std::size_t moving = moving_nodes(member);
    for (std::size_t n = 0; n < moving; ++n)
      member.is_in_soil[n] = of_member[static_cast<std::ptrdiff_t>(n)].in_soil > 0.5;
    for (std::size_t n = 0; n < moving; ++n)
    {
      any_left |= of_member[static_cast<std::ptrdiff_t>(n)].left > 0 || !member.is_in_soil[n];
      const auto leader = static_cast<std::ptrdiff_t>(leader_of(member, n));
      for (int a = 0; a < D; ++a)
        member.positions[n][a] += dt * of_member[leader].velocity[a];
    }
    of_member += static_cast<std::ptrdiff_t>(moving);
  }
  if (any_left)
    find_hosts(model, false);
}

template <class G>
double squared_frequency_of_members(Model<G>& model)
{
  constexpr int D = G::dim;
  if (model.members.empty())
    return 0;
  VelocityField<G>& field = model.fields.front();
  const auto sums_of_step = field.nodes; // with the forces of members, which reports show
  map_to_nodes(model);                   // masses of now, so that a run that goes on from a file takes the same steps
  std::vector<Vector<D>>& sums = field.contact_force; // its first component, as scratch
  sums.resize(field.nodes.size());
  for (Member<D>& member : model.members)
  {
    // Rows of |B|^T L D |B| of the member, summed: bounds of its largest eigenvalue by Gershgorin's theorem
    std::vector<double> rows(member.positions.size(), 0);
    for (std::size_t k = 0; k + 1 < rows.size(); ++k)
      for (const std::size_t n : {k, k + 1})
        rows[n] += 2 * member.properties.axial_stiffness / member.initial_lengths[k];
    for (std::size_t k = 0; k < member.moments.size(); ++k)
    {
      const double before = 1 / member.initial_lengths[k], after = 1 / member.initial_lengths[k + 1];
      const double stiffness = member.properties.bending_stiffness / length_of_bend<D>(member, k);
      const double all = 2 * (before + after);
      rows[k] += stiffness * before * all;
      rows[k + 1] += stiffness * (before + after) * all;
      rows[k + 2] += stiffness * after * all;
    }
    for (std::size_t n = 0; n < moving_nodes(member); ++n)
    {
      MemberHost<D>& host = member.hosts[n];
      if (host.cell == none)
        continue;
      const double density = weigh<G>(model, field, member.positions[n], host);
      const auto shapes = shape_functions<D>(model.mesh.shapes[host.cell], member.positions[n]);
      for (int k = 0; k <= D && density > 0; ++k)
      {
        const Index node = model.mesh.cells[host.cell][k];
        const double mass = density * model.volume_around[static_cast<std::size_t>(node)];
        sums[node][0] += std::max(0.0, shapes[k]) * rows[n] / mass;
      }
    }
  }
  sum_shared(model.exchange, sums);
  double largest = 0;
  for (Vector<D>& sum : sums)
  {
    largest = std::max(largest, sum[0]);
    sum = {};
  }
  field.nodes = sums_of_step;
  MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, model.exchange.comm);
  return largest;
}

#define INSTANTIATE_DIMENSION(D)                                                                                       \
  template Member<D> make_member<D>(std::string, const MemberProperties&, std::vector<Vector<D>>, std::vector<double>, \
                                    std::vector<double>);
INSTANTIATE_DIMENSION(2)
INSTANTIATE_DIMENSION(3)
#define INSTANTIATE(G)                                                                                                 \
  template void begin_members(Model<G>&, bool);                                                                        \
  template void add_member_forces(Model<G>&, VelocityField<G>&);                                                       \
  template void move_members(Model<G>&, double);                                                                       \
  template double squared_frequency_of_members(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
