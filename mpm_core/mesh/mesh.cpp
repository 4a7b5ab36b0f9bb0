#include "mesh/mesh.h"

#include "base/eigen.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <tuple>

namespace mpm::mesh
{
namespace
{
std::string show(auto... parts)
{
  std::ostringstream out;
  out.precision(9);
  (out << ... << parts);
  return out.str();
}

template <int D>
std::string show_point(const Vector<D>& x)
{
  std::string text = "(";
  for (int i = 0; i < D; ++i)
    text += (i ? ", " : "") + show(x[i]);
  return text + ")";
}

template <int D>
void check_input(const MeshInput<D>& input)
{
  auto same = [](const char* name, std::size_t size, std::size_t expected)
  {
    if (size != 0 && size != expected)
      throw InputError(show(name, " has ", size, " entries, expected ", expected));
  };
  if (input.points.size() % D != 0 || input.cells.size() % (D + 1) != 0)
    throw InputError(show("points and cells must have shapes (n, ", D, ") and (m, ", D + 1, ")"));
  const std::size_t nodes = input.points.size() / D, cells = input.cells.size() / (D + 1);
  same("cell_tags", input.cell_tags.size(), cells);
  same("facet_tags", input.facet_tags.size(), input.facets.size() / D);
  same("global_nodes", input.global_nodes.size(), nodes);
  same("global_cells", input.global_cells.size(), cells);
  same("cell_owners", input.cell_owners.size(), cells);
  for (std::size_t i = 0; i < input.points.size(); ++i)
    if (!std::isfinite(input.points[i]))
      throw InputError(show("points: coordinate ", i % D, " of node ", i / D, " is ", input.points[i],
                            ", expected a finite number"));
  for (std::span<const Index> numbers : {input.cells, input.facets})
    for (Index node : numbers)
      if (node < 0 || static_cast<std::size_t>(node) >= nodes)
        throw InputError(show(numbers.data() == input.cells.data() ? "cells" : "facets", ": node ", node,
                              " does not exist, the mesh has ", nodes, " nodes"));
}

template <int D>
Matrix<D> edges_of(const Mesh<D>& mesh, Index cell)
{
  const auto& nodes = mesh.cells[cell];
  Matrix<D> edges;
  for (int k = 0; k < D; ++k)
    for (int i = 0; i < D; ++i)
      edges[k][i] = mesh.points[nodes[k + 1]][i] - mesh.points[nodes[0]][i];
  return edges;
}

template <int D>
CellShape<D> make_shape(const Mesh<D>& mesh, Index cell)
{
  const Matrix<D> edges = edges_of(mesh, cell);
  const Vector<D>& x0 = mesh.points[mesh.cells[cell][0]];
  double longest = 0;
  for (const Vector<D>& edge : edges)
    longest = std::max(longest, norm<D>(edge));
  const CellShape<D> shape = shape_of_cell(mesh, cell);
  if (!(shape.volume * (D == 2 ? 2 : 6) > 1e-12 * std::pow(longest, D)))
    throw InputError(show("cells: cell ", cell, " with its first node at ", show_point<D>(x0), " has ",
                          D == 2 ? "area " : "volume ", shape.volume, ", expected a positive value"));
  return shape;
}

/// A facet of a cell, by its sorted nodes.
template <int D>
struct Facet
{
  std::array<Index, D> nodes;
  Index cell; ///< or the number of a tagged facet
  int vertex; ///< the vertex opposite to it, or -1 for a tagged facet
};

template <int D>
void connect(Mesh<D>& mesh, const MeshInput<D>& input)
{
  std::vector<Facet<D>> facets;
  facets.reserve(mesh.cells.size() * (D + 1) + input.facet_tags.size());
  auto add = [&facets](std::array<Index, D> nodes, Index number, int vertex)
  {
    std::sort(nodes.begin(), nodes.end());
    facets.push_back({nodes, number, vertex});
  };
  for (Index c = 0; c < mesh.n_cells(); ++c)
    for (int k = 0; k <= D; ++k)
      add(facet_nodes<D>(mesh.cells[c], k), c, k);
  for (std::size_t f = 0; f < input.facet_tags.size(); ++f)
  {
    std::array<Index, D> nodes;
    std::copy_n(input.facets.begin() + static_cast<std::ptrdiff_t>(f * D), D, nodes.begin());
    add(nodes, static_cast<Index>(f), -1);
  }
  std::sort(facets.begin(), facets.end(),
            [](const auto& a, const auto& b)
            { return std::tie(a.nodes, a.vertex, a.cell) < std::tie(b.nodes, b.vertex, b.cell); });

  for (std::size_t begin = 0, end; begin < facets.size(); begin = end)
  {
    end = begin + 1;
    while (end < facets.size() && facets[end].nodes == facets[begin].nodes)
      ++end;
    std::size_t first_cell = begin; // tagged facets sort before cells
    while (first_cell < end && facets[first_cell].vertex < 0)
      ++first_cell;
    const std::size_t sides = end - first_cell;
    const Vector<D>& where = mesh.points[facets[begin].nodes[0]];
    if (sides == 0)
      throw InputError(show("facets: tagged facet ", facets[begin].cell, " with a node at ", show_point<D>(where),
                            " is not a facet of any cell"));
    if (sides > 2)
      throw InputError(show("cells: ", sides, " cells share one facet with a node at ", show_point<D>(where),
                            ", expected at most two"));
    if (sides == 2)
    {
      const Facet<D>&a = facets[first_cell], &b = facets[first_cell + 1];
      const Vector<D>& opposite = mesh.points[mesh.cells[b.cell][b.vertex]];
      if (shape_functions<D>(mesh.shapes[a.cell], opposite)[a.vertex] > 0)
        throw InputError(show("cells: cells ", a.cell, " and ", b.cell, " overlap, both lie on the same side of their ",
                              "common facet at ", show_point<D>(where), " (one of them is inverted)"));
      mesh.neighbours[a.cell][a.vertex] = b.cell;
      mesh.neighbours[b.cell][b.vertex] = a.cell;
    }
    if (first_cell > begin)
      for (std::size_t s = first_cell; s < end; ++s)
        mesh.facet_tags[facets[s].cell][facets[s].vertex] = input.facet_tags[facets[begin].cell];
  }
}

template <int D>
void fill_bins(Mesh<D>& mesh)
{
  auto& bins = mesh.bins;
  Vector<D> low, high;
  low.fill(std::numeric_limits<double>::max());
  high.fill(std::numeric_limits<double>::lowest());
  for (const auto& x : mesh.points)
    for (int i = 0; i < D; ++i)
    {
      low[i] = std::min(low[i], x[i]);
      high[i] = std::max(high[i], x[i]);
    }
  double box = 1;
  for (int i = 0; i < D; ++i)
    box *= std::max(high[i] - low[i], 1e-300);
  bins.origin = low;
  bins.size = mesh.cells.empty() ? 1 : std::pow(box / static_cast<double>(mesh.cells.size()), 1.0 / D) * 1.5;
  std::size_t total = 1;
  for (int i = 0; i < D; ++i)
  {
    bins.counts[i] = mesh.cells.empty() ? 1 : static_cast<Index>((high[i] - low[i]) / bins.size) + 1;
    total *= static_cast<std::size_t>(bins.counts[i]);
  }

  // Calls f(bin) for every bin that the box of a cell touches.
  auto for_each_bin = [&](Index c, auto&& f)
  {
    std::array<Index, 3> first{0, 0, 0}, last{0, 0, 0};
    for (int i = 0; i < D; ++i)
    {
      double a = mesh.points[mesh.cells[c][0]][i], b = a;
      for (Index node : mesh.cells[c])
      {
        a = std::min(a, mesh.points[node][i]);
        b = std::max(b, mesh.points[node][i]);
      }
      first[i] = std::clamp(static_cast<Index>((a - low[i]) / bins.size), Index(0), bins.counts[i] - 1);
      last[i] = std::clamp(static_cast<Index>((b - low[i]) / bins.size), Index(0), bins.counts[i] - 1);
    }
    for (Index z = first[2]; z <= last[2]; ++z)
      for (Index y = first[1]; y <= last[1]; ++y)
        for (Index x = first[0]; x <= last[0]; ++x)
          f(static_cast<std::size_t>(x) +
            static_cast<std::size_t>(bins.counts[0]) *
                (static_cast<std::size_t>(y) +
                 (D == 3 ? static_cast<std::size_t>(bins.counts[1]) * static_cast<std::size_t>(z) : 0)));
  };
  bins.offsets.assign(total + 1, 0);
  for (Index c = 0; c < mesh.n_cells(); ++c)
    for_each_bin(c, [&](std::size_t b) { ++bins.offsets[b + 1]; });
  for (std::size_t b = 0; b < total; ++b)
    bins.offsets[b + 1] += bins.offsets[b];
  bins.cells.resize(static_cast<std::size_t>(bins.offsets[total]));
  std::vector<Index> next(bins.offsets.begin(), bins.offsets.end() - 1);
  for (Index c = 0; c < mesh.n_cells(); ++c)
    for_each_bin(c, [&](std::size_t b) { bins.cells[static_cast<std::size_t>(next[b]++)] = c; });
}
} // namespace

template <int D>
Mesh<D> make_mesh(const MeshInput<D>& input, int rank)
{
  check_input(input);
  Mesh<D> mesh;
  const std::size_t n = input.points.size() / D, m = input.cells.size() / (D + 1);
  mesh.points.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    std::copy_n(&input.points[i * D], D, mesh.points[i].begin());
  mesh.cells.resize(m);
  for (std::size_t c = 0; c < m; ++c)
    std::copy_n(&input.cells[c * (D + 1)], D + 1, mesh.cells[c].begin());

  auto numbers_or = [](auto values, std::size_t size, auto fallback)
  {
    using T = std::remove_const_t<typename decltype(values)::element_type>;
    std::vector<T> result(values.begin(), values.end());
    for (std::size_t i = result.size(); i < size; ++i)
      result.push_back(static_cast<T>(fallback(i)));
    return result;
  };
  auto own_number = [](std::size_t i) { return i; };
  mesh.cell_tags = numbers_or(input.cell_tags, m, [](std::size_t) { return 0; });
  mesh.global_nodes = numbers_or(input.global_nodes, n, own_number);
  mesh.global_cells = numbers_or(input.global_cells, m, own_number);
  mesh.cell_owners = numbers_or(input.cell_owners, m, [rank](std::size_t) { return rank; });
  while (mesh.owned_cells < mesh.n_cells() && mesh.cell_owners[static_cast<std::size_t>(mesh.owned_cells)] == rank)
    ++mesh.owned_cells;
  for (Index c = mesh.owned_cells; c < mesh.n_cells(); ++c)
    if (mesh.cell_owners[static_cast<std::size_t>(c)] == rank)
      throw InputError(show("cell_owners: owned cell ", c, " comes after a ghost cell, expected owned cells first"));

  mesh.shapes.reserve(m);
  double farthest = 1; // |x| / h
  for (Index c = 0; c < mesh.n_cells(); ++c)
  {
    mesh.shapes.push_back(make_shape<D>(mesh, c));
    const CellShape<D>& shape = mesh.shapes.back();
    farthest = std::max(farthest, std::sqrt(dot<D>(shape.centre, shape.centre)) / smallest_altitude(shape));
  }
  mesh.round_off *= farthest;
  std::array<Index, D + 1> no;
  no.fill(none);
  mesh.neighbours.assign(m, no);
  mesh.facet_tags.assign(m, no);
  connect(mesh, input);
  fill_bins(mesh);
  return mesh;
}

template <int D>
CellShape<D> shape_of_cell(const Mesh<D>& mesh, Index cell)
{
  const Matrix<D> edges = edges_of(mesh, cell);
  const Vector<D>& x0 = mesh.points[mesh.cells[cell][0]];
  CellShape<D> shape{};
  for (const Vector<D>& edge : edges)
    for (int i = 0; i < D; ++i)
      shape.centre[i] += edge[i] / (D + 1);
  for (int i = 0; i < D; ++i)
    shape.centre[i] += x0[i];
  shape.volume = std::abs(as_eigen<D>(edges).determinant()) / (D == 2 ? 2 : 6);
  const Eigen::Matrix<double, D, D> inverse = as_eigen<D>(edges).inverse(); // column k: gradient of vertex k + 1
  for (int k = 0; k < D; ++k)
    for (int i = 0; i < D; ++i)
    {
      shape.gradient[k + 1][i] = inverse(i, k);
      shape.gradient[0][i] -= inverse(i, k);
    }
  return shape;
}

template <int D>
double smallest_altitude(const CellShape<D>& shape)
{
  double steepest = 0;
  for (const auto& g : shape.gradient)
    steepest = std::max(steepest, dot<D>(g, g));
  return 1 / std::sqrt(steepest);
}

template Mesh<2> make_mesh(const MeshInput<2>&, int);
template Mesh<3> make_mesh(const MeshInput<3>&, int);
template CellShape<2> shape_of_cell(const Mesh<2>&, Index);
template CellShape<3> shape_of_cell(const Mesh<3>&, Index);
template double smallest_altitude<2>(const CellShape<2>&);
template double smallest_altitude<3>(const CellShape<3>&);
} // namespace mpm::mesh
