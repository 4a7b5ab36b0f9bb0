#include "steps/implicit_system.h"

#include "steps/integration.h"

#include <algorithm>

namespace mpm
{
namespace
{
template <int D>
std::vector<Index> filled_cells(const Model<D>& model)
{
  std::vector<Index> cells;
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    if (model.work.moments[c].volume > 0)
      cells.push_back(c);
  return cells;
}

/// P = 1 - sum d d^T of a node's supported directions.
template <int D>
Matrix<D> projector(const Model<D>& model, const ImplicitSystem<D>& system, Index node)
{
  Matrix<D> p{};
  for (int i = 0; i < D; ++i)
    p[i][i] = 1;
  if (system.support[node] == none)
    return p;
  const Support<D>& support = model.supports[system.support[node]];
  for (int k = 0; k < support.count; ++k)
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        p[i][j] -= support.direction[k][i] * support.direction[k][j];
  return p;
}

template <int D>
Matrix<D> product(const Matrix<D>& a, const Matrix<D>& b)
{
  Matrix<D> c{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k)
        c[i][j] += a[i][k] * b[k][j];
  return c;
}

template <int D>
Vector<D> product(const Matrix<D>& a, const Vector<D>& b)
{
  Vector<D> c;
  for (int i = 0; i < D; ++i)
    c[i] = dot<D>(a[i], b);
  return c;
}

/// Adds entries in order; rows and columns only the first time.
class Writer
{
public:
  explicit Writer(CooEntries& entries) : _entries(entries), _places(entries.rows.empty()) { entries.values.clear(); }

  void add(GlobalIndex row, GlobalIndex column, double value)
  {
    _entries.values.push_back(value);
    if (!_places)
      return;
    _entries.rows.push_back(row);
    _entries.columns.push_back(column);
  }

  template <int D>
  void add_block(GlobalIndex row, GlobalIndex column, const Matrix<D>& block)
  {
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        add(D * row + i, D * column + j, block[i][j]);
  }

private:
  CooEntries& _entries;
  bool _places;
};

/// d f_int of a vertex with gradient g_k / du of one with gradient g_l
template <int D>
Matrix<D> cell_block(const CellTangent<D>& tangent, const Vector<D>& g_k, const Vector<D>& g_l)
{
  Matrix<D> block{};
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      for (int j = 0; j < D; ++j)
        for (int m = 0; m < D; ++m)
          block[a][b] += g_k[j] * tangent.by_gradient[symmetric_index<D>(a, j)][b * D + m] * g_l[m];
  return block;
}

/// Projectors of a cell's vertices.
template <int D>
std::array<Matrix<D>, D + 1> projectors(const Model<D>& model, const ImplicitSystem<D>& system, Index c)
{
  std::array<Matrix<D>, D + 1> p;
  for (int k = 0; k <= D; ++k)
    p[k] = projector(model, system, model.mesh.cells[c][k]);
  return p;
}
/// Rows of the nodes to whose forces this rank adds; the same from both sides of a rank boundary.
template <int D>
void add_ghost_entries(const Model<D>& model, const ImplicitStep<D>& step, const ImplicitSystem<D>& system,
                       const GhostFacet<D>& facet, Writer& writer)
{
  const double factor = facet.stiffness + (step.options.quasi_static ? 0 : facet.mass / (step.dt * step.dt));
  for (int k = 0; k < D + 2; ++k)
    for (int l = 0; l < D + 2; ++l)
    {
      if (facet.share[k] == 0)
        continue;
      Matrix<D> block = product<D>(projector(model, system, facet.nodes[k]), projector(model, system, facet.nodes[l]));
      for (auto& row : block)
        for (double& value : row)
          value *= facet.share[k] * factor * facet.jump[k] * facet.jump[l];
      writer.add_block<D>(system.number[facet.nodes[k]], system.number[facet.nodes[l]], block);
    }
}
} // namespace

template <int D>
bool number_nodes(Model<D>& model, const ImplicitStep<D>& step, ImplicitSystem<D>& system)
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

  const auto count = static_cast<GlobalIndex>(owned.size());
  GlobalIndex first = 0;
  MPI_Exscan(&count, &first, 1, MPI_INT64_T, MPI_SUM, exchange.comm);
  if (exchange.rank == 0)
    first = 0;
  MPI_Allreduce(&count, &system.total, 1, MPI_INT64_T, MPI_SUM, exchange.comm);
  std::vector<std::array<double, 2>> sums(static_cast<std::size_t>(n)); // number, stiffness; whole numbers are exact
  for (std::size_t k = 0; k < owned.size(); ++k)
    sums[owned[k]][0] = static_cast<double>(first + static_cast<GlobalIndex>(k));
  for (const Run& run : model.work.runs)
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
  for (std::size_t s = 0; s < model.supports.size(); ++s)
    system.support[model.supports[s].node] = static_cast<Index>(s);
  return changed;
}

template <int D>
void stiffness_entries(const Model<D>& model, const ImplicitStep<D>& step, const ImplicitSystem<D>& system,
                       CooEntries& entries)
{
  Writer writer(entries);
  for (Index c : system.cells)
  {
    const auto p = projectors(model, system, c);
    const auto& gradient = model.mesh.shapes[c].gradient;
    for (int k = 0; k <= D; ++k)
      for (int l = 0; l <= D; ++l)
      {
        const Matrix<D> block = cell_block<D>(step.tangents[c], gradient[k], gradient[l]);
        writer.add_block<D>(system.number[model.mesh.cells[c][k]], system.number[model.mesh.cells[c][l]],
                            product<D>(p[k], product<D>(block, p[l])));
      }
  }
  for (const GhostFacet<D>& facet : step.ghosts)
    add_ghost_entries(model, step, system, facet, writer);
  for (Index node : system.owned)
  {
    const Matrix<D> p = projector(model, system, node);
    Matrix<D> inertia{};
    for (int a = 0; a < D; ++a)
      inertia[a][a] = inertia_force(model, step, node, a).derivative / step.dt;
    Matrix<D> block = product<D>(p, product<D>(inertia, p));
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        block[i][j] += system.diagonal[node] * ((i == j ? 1.0 : 0.0) - p[i][j]);
    writer.add_block<D>(system.number[node], system.number[node], block);
  }
}

template <int D>
void volumetric_force_entries(const Model<D>& model, const ImplicitStep<D>& step, const ImplicitSystem<D>& system,
                              CooEntries& entries)
{
  Writer writer(entries);
  for (Index c : system.cells)
  {
    const auto p = projectors(model, system, c);
    for (int k = 0; k <= D; ++k)
    {
      Vector<D> force =
          product<D>(p[k], internal_force<D>(step.tangents[c].by_volumetric, model.mesh.shapes[c].gradient[k]));
      for (int l = 0; l <= D; ++l) // the cell has the mean of its nodes
        for (int a = 0; a < D; ++a)
          writer.add(D * system.number[model.mesh.cells[c][k]] + a, system.number[model.mesh.cells[c][l]],
                     force[a] / (D + 1));
    }
  }
}

template <int D>
void volumetric_strain_entries(const Model<D>& model, const ImplicitSystem<D>& system, CooEntries& entries)
{
  Writer writer(entries);
  for (Index c : system.cells)
    for (int k = 0; k <= D; ++k)
    {
      const Index node = model.mesh.cells[c][k];
      const double weight = integrated_volume(model, c) / model.work.volumetric_strain[node].volume;
      for (int l = 0; l <= D; ++l)
      {
        const Index other = model.mesh.cells[c][l];
        const Vector<D> change = product<D>(projector(model, system, other), model.mesh.shapes[c].gradient[l]);
        for (int b = 0; b < D; ++b)
          writer.add(system.number[node], D * system.number[other] + b, weight * change[b]);
      }
    }
}

template <int D>
void mean_stress_entries(const Model<D>& model, const ImplicitStep<D>& step, const ImplicitSystem<D>& system,
                         CooEntries& by_displacement, CooEntries& by_strain)
{
  Writer displacement(by_displacement), strain(by_strain);
  for (Index c : system.cells)
  {
    const CellTangent<D>& tangent = step.tangents[c];
    for (int l = 0; l <= D; ++l)
    {
      const Index other = model.mesh.cells[c][l];
      Vector<D> change{};
      for (int b = 0; b < D; ++b)
        for (int m = 0; m < D; ++m)
          change[b] += tangent.mean_by_gradient[b * D + m] * model.mesh.shapes[c].gradient[l][m] / (D + 1);
      change = product<D>(projector(model, system, other), change);
      for (int k = 0; k <= D; ++k)
      {
        const GlobalIndex row = system.number[model.mesh.cells[c][k]];
        for (int b = 0; b < D; ++b)
          displacement.add(row, D * system.number[other] + b, change[b]);
        strain.add(row, system.number[other], tangent.mean_by_volumetric / ((D + 1) * (D + 1)));
      }
    }
  }
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
  template bool number_nodes(Model<D>&, const ImplicitStep<D>&, ImplicitSystem<D>&);                                   \
  template void stiffness_entries(const Model<D>&, const ImplicitStep<D>&, const ImplicitSystem<D>&, CooEntries&);     \
  template void volumetric_force_entries(const Model<D>&, const ImplicitStep<D>&, const ImplicitSystem<D>&,            \
                                         CooEntries&);                                                                 \
  template void volumetric_strain_entries(const Model<D>&, const ImplicitSystem<D>&, CooEntries&);                     \
  template void mean_stress_entries(const Model<D>&, const ImplicitStep<D>&, const ImplicitSystem<D>&, CooEntries&,    \
                                    CooEntries&);                                                                      \
  template std::vector<double> owned_values<D>(const ImplicitSystem<D>&, std::span<const Vector<D>>);                  \
  template void set_nodal<D>(NodeExchange&, const ImplicitSystem<D>&, std::span<const double>, std::span<Vector<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
