#include "model/members.h"

#include "mesh/search.h"
#include "model/mapping.h"
#include "model/member_forces.h"

#include <algorithm>
#include <sstream>

namespace mpm::model
{
namespace
{
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
    const std::vector<double> rows = stiffness_rows<D>(member);
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

#define INSTANTIATE(G)                                                                                                 \
  template void begin_members(Model<G>&, bool);                                                                        \
  template void add_member_forces(Model<G>&, VelocityField<G>&);                                                       \
  template void move_members(Model<G>&, double);                                                                       \
  template double squared_frequency_of_members(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
