#include "implicit/system.h"

#include "parallel/row_slice.h"

#include <algorithm>

namespace mpm
{
namespace
{
template <class G, int D = G::dim>
std::vector<Index> filled_cells(const Model<G>& model)
{
  std::vector<Index> cells;
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    if (model.fields.front().moments[c].volume > 0)
      cells.push_back(c);
  return cells;
}
} // namespace

template <class G, int D>
bool number_nodes(Model<G>& model, const ImplicitStep<G>& step, ImplicitSystem<D>& system)
{
  NodeExchange& exchange = model.exchange;
  const Index n = model.mesh.n_nodes();
  std::vector<Index> owned, cells = filled_cells(model);
  for (Index i = 0; i < n; ++i)
    if (exchange.owned[i] && step.active[i])
      owned.push_back(i);
  std::vector<std::array<Index, 2>> ghosts;
  for (const GhostFacet<D>& facet : step.ghosts)
    ghosts.push_back({facet.nodes[D], facet.nodes[D + 1]});
  int changed = owned != system.owned || cells != system.cells || ghosts != system.ghosts;
  MPI_Allreduce(MPI_IN_PLACE, &changed, 1, MPI_INT, MPI_MAX, exchange.comm);

  const RowSlice rows = row_slice(exchange.comm, owned.size());
  system.total = rows.total;
  std::vector<std::array<double, 2>> sums(static_cast<std::size_t>(n)); // number, stiffness; whole numbers are exact
  for (std::size_t k = 0; k < owned.size(); ++k)
    sums[owned[k]][0] = static_cast<double>(rows.before + static_cast<GlobalIndex>(k));
  for (const Run& run : model.order.runs)
  {
    double volume = 0;
    for (Index p = run.first; p < run.last; ++p)
      volume += model.particles.volume[p];
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D>& g = model.mesh.shapes[run.cell].gradient[k];
      sums[model.mesh.cells[run.cell][k]][1] += volume * p_wave_modulus(model.laws[run.material]) * dot<D>(g, g);
    }
  }
  sum_shared(exchange, sums);
  update(step.halos.nodes, sums);

  system.owned = std::move(owned);
  system.cells = std::move(cells);
  system.ghosts = std::move(ghosts);
  system.number.resize(sums.size());
  system.diagonal.resize(sums.size());
  for (std::size_t i = 0; i < sums.size(); ++i)
  {
    system.number[i] = sums[i][1] > 0 ? static_cast<GlobalIndex>(sums[i][0]) : none;
    system.diagonal[i] = sums[i][1];
  }
  system.support.assign(sums.size(), none);
  for (std::size_t s = 0; s < model.fields.front().supports.size(); ++s)
    system.support[model.fields.front().supports[s].node] = static_cast<Index>(s);
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

template bool number_nodes(Model<PlaneStrain>&, const ImplicitStep<PlaneStrain>&, ImplicitSystem<2>&);
template bool number_nodes(Model<Axisymmetric>&, const ImplicitStep<Axisymmetric>&, ImplicitSystem<2>&);
template bool number_nodes(Model<Solid>&, const ImplicitStep<Solid>&, ImplicitSystem<3>&);
#define INSTANTIATE(D)                                                                                                 \
  template std::vector<double> owned_values<D>(const ImplicitSystem<D>&, std::span<const Vector<D>>);                  \
  template void set_nodal<D>(NodeExchange&, const ImplicitSystem<D>&, std::span<const double>, std::span<Vector<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
