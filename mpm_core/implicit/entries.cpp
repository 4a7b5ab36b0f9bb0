#include "implicit/system.h"

#include "model/integration.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// P = 1 - sum d d^T of a node's supported directions.
template <class G, int D = G::dim>
Matrix<D> projector(const Model<G>& model, const ImplicitSystem<D>& system, Index node)
{
  Matrix<D> p{};
  for (int i = 0; i < D; ++i)
    p[i][i] = 1;
  if (system.support[node] == none)
    return p;
  const Support<D>& support = model.fields.front().supports[system.support[node]];
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
  /// @param size  how many entries there will be
  Writer(CooEntries& entries, std::size_t size) : _entries(entries), _places(entries.rows.empty())
  {
    entries.values.resize(size);
    if (!_places)
      return;
    entries.rows.resize(size);
    entries.columns.resize(size);
  }

  void add(GlobalIndex row, GlobalIndex column, double value)
  {
    _entries.values[_next] = value;
    if (_places)
    {
      _entries.rows[_next] = row;
      _entries.columns[_next] = column;
    }
    ++_next;
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
  std::size_t _next = 0;
};

/// d f_int of vertex k / du of vertex l of a cell
template <class G, int D = G::dim>
Matrix<D> cell_block(const CellTangent<G>& tangent, const CellShape<D>& shape, int k, int l)
{
  Matrix<D> block{};
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      for (int j = 0; j < D; ++j)
        for (int m = 0; m < D; ++m)
          block[a][b] +=
              shape.gradient[k][j] * tangent.by_gradient[symmetric_index<D>(a, j)][b * D + m] * shape.gradient[l][m];
  if constexpr (G::has_hoop)
  {
    const double hoop = hoop_gradient<G>(shape);
    const auto& by_hoop = tangent.by_gradient[n_symmetric<D>];
    for (int a = 0; a < D; ++a) // forces of stresses in the plane, by the hoop strain
      for (int j = 0; j < D; ++j)
        block[a][0] += shape.gradient[k][j] * tangent.by_gradient[symmetric_index<D>(a, j)][D * D] * hoop;
    for (int b = 0; b < D; ++b) // that of the hoop stress, by strains in the plane
      for (int m = 0; m < D; ++m)
        block[0][b] += hoop * by_hoop[b * D + m] * shape.gradient[l][m];
    block[0][0] += hoop * by_hoop[D * D] * hoop;
  }
  return block;
}

/// Projectors of a cell's vertices.
template <class G, int D = G::dim>
std::array<Matrix<D>, D + 1> projectors(const Model<G>& model, const ImplicitSystem<D>& system, Index c)
{
  std::array<Matrix<D>, D + 1> p;
  for (int k = 0; k <= D; ++k)
    p[k] = projector(model, system, model.mesh.cells[c][k]);
  return p;
}

/// Entries of all cells, each between two of its nodes.
template <int D>
std::size_t entries_of_cells(const ImplicitSystem<D>& system, int per_pair)
{
  return system.cells.size() * static_cast<std::size_t>((D + 1) * (D + 1) * per_pair);
}

/// Entries of `add_ghost_entries` over all facets.
template <class G, int D = G::dim>
std::size_t entries_of_ghosts(const ImplicitStep<G>& step)
{
  std::size_t rows = 0;
  for (const GhostFacet<D>& facet : step.ghosts)
    for (int k = 0; k < D + 2; ++k)
      rows += facet.share[k] != 0;
  return rows * (D + 2) * D * D;
}

/// Rows of the nodes to whose forces this rank adds; the same from both sides of a rank boundary.
template <class G, int D = G::dim>
void add_ghost_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                       const GhostFacet<D>& facet, Writer& writer)
{
  const double factor =
      facet.stiffness + (step.options.quasi_static ? 0 : facet.mass / (step.stage.weight * step.stage.dt * step.dt));
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

template <class G, int D>
void stiffness_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                       CooEntries& entries)
{
  Writer writer(entries, entries_of_cells(system, D * D) + entries_of_ghosts(step) + system.owned.size() * D * D);
  for (Index c : system.cells)
  {
    const auto& nodes = model.mesh.cells[c];
    const bool held = std::any_of(nodes.begin(), nodes.end(), [&](Index i) { return system.support[i] != none; });
    const auto p = held ? projectors(model, system, c) : std::array<Matrix<D>, D + 1>{};
    for (int k = 0; k <= D; ++k)
      for (int l = 0; l <= D; ++l)
      {
        const Matrix<D> block = cell_block(step.tangents[c], model.mesh.shapes[c], k, l);
        writer.add_block<D>(system.number[nodes[k]], system.number[nodes[l]],
                            held ? product<D>(p[k], product<D>(block, p[l])) : block);
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

template <class G, int D>
void volumetric_force_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                              CooEntries& entries)
{
  Writer writer(entries, entries_of_cells(system, D));
  for (Index c : system.cells)
  {
    const auto p = projectors(model, system, c);
    for (int k = 0; k <= D; ++k)
    {
      Vector<D> force = product<D>(p[k], internal_force<G>(step.tangents[c].by_volumetric, model.mesh.shapes[c], k));
      for (int l = 0; l <= D; ++l) // the cell has the mean of its nodes
        for (int a = 0; a < D; ++a)
          writer.add(D * system.number[model.mesh.cells[c][k]] + a, system.number[model.mesh.cells[c][l]],
                     force[a] / (D + 1));
    }
  }
}

template <class G, int D>
void volumetric_strain_entries(const Model<G>& model, const ImplicitSystem<D>& system, CooEntries& entries)
{
  Writer writer(entries, entries_of_cells(system, D));
  for (Index c : system.cells)
    for (int k = 0; k <= D; ++k)
    {
      const Index node = model.mesh.cells[c][k];
      const double weight =
          integrated_volume(model.mesh, model.fields.front(), c) / model.fields.front().volumetric_strain[node].volume;
      for (int l = 0; l <= D; ++l)
      {
        const Index other = model.mesh.cells[c][l];
        Vector<D> volumetric = model.mesh.shapes[c].gradient[l];
        if constexpr (G::has_hoop)
          volumetric[0] += hoop_gradient<G>(model.mesh.shapes[c]);
        const Vector<D> change = product<D>(projector(model, system, other), volumetric);
        for (int b = 0; b < D; ++b)
          writer.add(system.number[node], D * system.number[other] + b, weight * change[b]);
      }
    }
}

template <class G, int D>
void mean_stress_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                         CooEntries& by_displacement, CooEntries& by_strain)
{
  Writer displacement(by_displacement, entries_of_cells(system, D)), strain(by_strain, entries_of_cells(system, 1));
  for (Index c : system.cells)
  {
    const CellTangent<G>& tangent = step.tangents[c];
    for (int l = 0; l <= D; ++l)
    {
      const Index other = model.mesh.cells[c][l];
      Vector<D> change{};
      const auto rows = gradient_rows<G>(model.mesh.shapes[c], l);
      for (int b = 0; b < D; ++b)
        for (int m = 0; m < n_gradient<G>; ++m)
          change[b] += tangent.mean_by_gradient[m] * rows[b][m] / (D + 1);
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

#define INSTANTIATE(G)                                                                                                 \
  template void stiffness_entries(const Model<G>&, const ImplicitStep<G>&, const ImplicitSystem<G::dim>&,              \
                                  CooEntries&);                                                                        \
  template void volumetric_force_entries(const Model<G>&, const ImplicitStep<G>&, const ImplicitSystem<G::dim>&,       \
                                         CooEntries&);                                                                 \
  template void volumetric_strain_entries(const Model<G>&, const ImplicitSystem<G::dim>&, CooEntries&);                \
  template void mean_stress_entries(const Model<G>&, const ImplicitStep<G>&, const ImplicitSystem<G::dim>&,            \
                                    CooEntries&, CooEntries&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm
