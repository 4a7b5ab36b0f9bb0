#include "model/far_field.h"

#include "model/mapping.h"

#include <algorithm>
#include <unordered_map>

namespace mpm::model
{
namespace
{
/// Local numbers of nodes that this rank owns, by their places in a list of numbers over all ranks; `none` for others.
template <int D>
std::vector<Index> owned_among(const Mesh<D>& mesh, const NodeExchange& exchange, std::span<const GlobalIndex> nodes)
{
  std::unordered_map<GlobalIndex, Index> local;
  for (Index i = 0; i < mesh.n_nodes(); ++i)
    if (exchange.owned[static_cast<std::size_t>(i)])
      local[mesh.global_nodes[static_cast<std::size_t>(i)]] = i;
  std::vector<Index> found;
  for (GlobalIndex node : nodes)
    found.push_back(local.contains(node) ? local[node] : none);
  return found;
}
} // namespace

template <class G>
std::vector<Vector<G::dim>> unbalanced_at(Model<G>& model, std::span<const GlobalIndex> nodes,
                                          const Vector<G::dim>& gravity)
{
  constexpr int D = G::dim;
  prepare(model);
  map_to_nodes(model);
  const VelocityField<G>& field = model.fields.front();
  const std::vector<Index> local = owned_among(model.mesh, model.exchange, nodes);
  std::vector<Vector<D>> forces(nodes.size());
  std::vector<int> has_soil(nodes.size(), 0);
  for (std::size_t k = 0; k < nodes.size(); ++k)
    if (local[k] != none && field.nodes[local[k]].mass > 0)
    {
      has_soil[k] = 1;
      forces[k] = unbalanced_force<D>(field.nodes[local[k]], gravity);
    }
  MPI_Allreduce(MPI_IN_PLACE, has_soil.data(), static_cast<int>(nodes.size()), MPI_INT, MPI_MAX, model.exchange.comm);
  if (const auto bare = std::ranges::find(has_soil, 0); bare != has_soil.end())
    throw InputError(
        "node " + std::to_string(nodes[static_cast<std::size_t>(bare - has_soil.begin())]) +
        " on the border of the far field has no soil around it, expected particles along the whole border");
  return forces;
}

template <class G>
void set_far_field(Model<G>& model, std::span<const GlobalIndex> nodes, std::span<const double> stiffness,
                   std::span<const double> mass, std::span<const double> held, std::span<const double> displacement)
{
  constexpr int D = G::dim;
  FarField<D> far;
  far.size = nodes.size();
  far.displacement.assign(displacement.begin(), displacement.end());
  const std::vector<Index> local = owned_among(model.mesh, model.exchange, nodes);
  const std::size_t block = D * D * far.size; // the rows of a node
  for (std::size_t k = 0; k < nodes.size(); ++k)
  {
    if (local[k] == none)
      continue;
    far.nodes.push_back(local[k]);
    far.numbers.push_back(k);
    far.stiffness.insert(far.stiffness.end(), &stiffness[k * block], &stiffness[k * block] + block);
    std::copy_n(&held[k * D], D, far.held.emplace_back().begin());
    Matrix<D>& weight = far.mass.emplace_back();
    for (std::size_t a = 0; a < D; ++a)
      std::copy_n(&mass[(k * D + a) * D], D, weight[a].begin());
  }
  model.fields.front().far_field = std::move(far);
}

template <int D>
void add_far_field_forces(const FarField<D>& far, const Vector<D>& gravity, std::span<Vector<D>> forces)
{
  const auto springs = border_forces(far, far.displacement);
  for (std::size_t k = 0; k < springs.size(); ++k)
  {
    const Vector<D> weight = product<D>(far.mass[k], gravity);
    for (int a = 0; a < D; ++a)
      forces[static_cast<std::size_t>(far.nodes[k])][a] += far.held[k][a] + weight[a] - springs[k][a];
  }
}

template <int D>
std::vector<double> border_values(const NodeExchange& exchange, const FarField<D>& far,
                                  std::span<const Vector<D>> nodal, double factor)
{
  std::vector<double> values(far.size * D, 0.0);
  for (std::size_t k = 0; k < far.nodes.size(); ++k)
    for (std::size_t a = 0; a < D; ++a)
      values[far.numbers[k] * D + a] = factor * nodal[static_cast<std::size_t>(far.nodes[k])][a];
  if (far.size > 0)
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_SUM, exchange.comm);
  return values;
}

template <class G>
void move_border(const NodeExchange& exchange, double dt, VelocityField<G>& field)
{
  FarField<G::dim>& far = field.far_field;
  const auto moved = border_values<G::dim>(exchange, far, field.velocity, dt);
  for (std::size_t j = 0; j < moved.size(); ++j)
    far.displacement[j] += moved[j];
}

#define INSTANTIATE(D)                                                                                                 \
  template void add_far_field_forces<D>(const FarField<D>&, const Vector<D>&, std::span<Vector<D>>);                   \
  template std::vector<double> border_values<D>(const NodeExchange&, const FarField<D>&, std::span<const Vector<D>>,   \
                                                double);
INSTANTIATE(2)
INSTANTIATE(3)
#undef INSTANTIATE
#define INSTANTIATE(G)                                                                                                 \
  template std::vector<Vector<G::dim>> unbalanced_at(Model<G>&, std::span<const GlobalIndex>, const Vector<G::dim>&);  \
  template void set_far_field(Model<G>&, std::span<const GlobalIndex>, std::span<const double>,                        \
                              std::span<const double>, std::span<const double>, std::span<const double>);              \
  template void move_border(const NodeExchange&, double, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
