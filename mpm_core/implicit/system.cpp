#include "implicit/system.h"

#include "parallel/messages.h"

#include <algorithm>

namespace mpm::implicit
{
namespace
{
/// P = 1 - sum d d^T of supported directions.
template <int D>
Matrix<D> projector_of(const Support<D>& support)
{
  Matrix<D> p{};
  for (int i = 0; i < D; ++i)
    p[i][i] = 1;
  for (int k = 0; k < support.count; ++k)
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        p[i][j] -= support.direction[k][i] * support.direction[k][j];
  return p;
}

template <int D>
void set_supports(std::span<const Support<D>> supports, std::size_t nodes, ImplicitSystem<D>& system)
{
  system.support.assign(nodes, none);
  system.projectors.clear();
  for (std::size_t s = 0; s < supports.size(); ++s)
  {
    system.support[supports[s].node] = static_cast<Index>(s);
    system.projectors.push_back(projector_of(supports[s]));
  }
}

/// Numbers the means of the nodes where several groups of soils are averaged apart.
template <int D>
void number_means(const AveragedGroups& groups, ImplicitSystem<D>& system)
{
  system.groups = groups;
  system.number_of_mean.clear();
  if (groups.count == 1)
    return;
  for (const GlobalIndex number : system.number)
    for (int group = 0; group < groups.count; ++group)
      system.number_of_mean.push_back(number == none ? none : groups.count * number + group);
}

/// Numbers and projectors of the nodes on the border of the far field, from the ranks that have them.
/// @throws RunError on all ranks: a node without soil
/// @note Collective where there is a far field
template <int D>
std::vector<BorderNode<D>> border_nodes(const NodeExchange& exchange, const FarField<D>& far,
                                        const ImplicitSystem<D>& system)
{
  constexpr std::size_t width = 1 + D * D;
  std::vector<double> sums(far.size * width, 0.0); // numbers from 1; whole numbers are exact
  for (std::size_t k = 0; k < far.nodes.size(); ++k)
  {
    double* const entry = &sums[far.numbers[k] * width];
    entry[0] = static_cast<double>(system.number[far.nodes[k]] + 1);
    const Matrix<D> p = projector(system, far.nodes[k]);
    for (int a = 0; a < D; ++a)
      std::copy_n(p[a].begin(), D, entry + 1 + a * D);
  }
  if (far.size > 0)
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, exchange.comm);
  std::vector<BorderNode<D>> border(far.size);
  for (std::size_t k = 0; k < border.size(); ++k)
  {
    const double* const entry = &sums[k * width];
    if (entry[0] < 1)
      throw RunError("the soil has left node " + std::to_string(k) +
                     " of the border of the far field, which holds where soil stays beside it only");
    border[k].number = static_cast<GlobalIndex>(entry[0]) - 1;
    for (int a = 0; a < D; ++a)
      std::copy_n(entry + 1 + a * D, D, border[k].projector[a].begin());
  }
  return border;
}
} // namespace

template <class G, int D>
bool number_nodes(NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step,
                  ImplicitSystem<D>& system)
{
  std::vector<Index> owned;
  for (std::size_t i = 0; i < step.active.size(); ++i)
    if (exchange.owned[i] && step.active[i])
      owned.push_back(static_cast<Index>(i));
  std::vector<std::array<Index, 2>> ghosts;
  for (const GhostFacet<D>& facet : step.ghosts)
    ghosts.push_back({facet.nodes[D], facet.nodes[D + 1]});
  int changed = owned != system.owned || step.cells != system.cells || ghosts != system.ghosts ||
                step.has_contacts != system.has_contacts || field.integration.groups.of_cell != system.groups.of_cell ||
                field.integration.groups.count != system.groups.count;
  MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, exchange.comm);

  system.unknowns = step.pore.flows ? D + 1 : D;
  const RowSlice rows = row_slice(exchange.comm, owned.size());
  system.total = rows.total;
  std::vector<std::array<double, 2>> sums(step.active.size()); // number, stiffness; whole numbers are exact
  for (std::size_t k = 0; k < owned.size(); ++k)
    sums[owned[k]][0] = static_cast<double>(rows.before + static_cast<GlobalIndex>(k));
  for (std::size_t i = 0; i < sums.size(); ++i)
    sums[i][1] = step.elastic[i];
  sum_shared(exchange, sums);
  update(step.halos.nodes, sums);

  system.owned = std::move(owned);
  system.cells = step.cells;
  system.has_contacts = step.has_contacts;
  system.ghosts = std::move(ghosts);
  system.number.resize(sums.size());
  system.diagonal.resize(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i)
  {
    system.number[i] = sums[i][1] > 0 ? static_cast<GlobalIndex>(sums[i][0]) : none;
    system.diagonal[i] = sums[i][1];
  }
  number_means(field.integration.groups, system);
  set_supports<D>(field.supports, sums.size(), system);
  system.border = border_nodes(exchange, field.far_field, system);
  return changed;
}

template <int D>
std::vector<double> owned_values(const ImplicitSystem<D>& system, std::span<const Vector<D>> nodal)
{
  std::vector<double> values;
  values.reserve(system.owned.size() * D);
  for (Index node : system.owned)
    values.insert(values.end(), nodal[node].begin(), nodal[node].end());
  return values;
}

template <int D>
void set_nodal(NodeExchange& exchange, const ImplicitSystem<D>& system, std::span<const double> values,
               std::span<Vector<D>> nodal)
{
  std::fill(nodal.begin(), nodal.end(), Vector<D>{});
  for (std::size_t k = 0; k < system.owned.size(); ++k)
    std::copy_n(&values[k * D], D, nodal[system.owned[k]].begin());
  sum_shared(exchange, nodal);
}

#define INSTANTIATE(D)                                                                                                 \
  template std::vector<double> owned_values<D>(const ImplicitSystem<D>&, std::span<const Vector<D>>);                  \
  template void set_nodal<D>(NodeExchange&, const ImplicitSystem<D>&, std::span<const double>, std::span<Vector<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
#undef INSTANTIATE
#define INSTANTIATE(G)                                                                                                 \
  template bool number_nodes(NodeExchange&, const VelocityField<G>&, const ImplicitStep<G>&, ImplicitSystem<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
