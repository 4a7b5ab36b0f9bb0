#include "implicit/pore_surface.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
namespace
{
constexpr double penalty = 100;

/// Filled fraction up to which a node at an empty cell is at the surface, though the cells below may be a little too
/// full; above it the cell is a gap between particles within the soil.
constexpr double most_at_surface = 0.7;

/// What the cells around a node say; plain doubles.
struct Around
{
  double volume; ///< of all of them, the part of this node
  double empty;  ///< number of those without particles
};

/// Distance from the surface over the size of the cells, from the filled fraction of a node; positive in the soil.
double distance(double fraction)
{
  return fraction >= 0.5 ? 1 - std::sqrt(std::max(0.0, 2 * (1 - fraction))) : std::sqrt(2 * fraction) - 1;
}

/// Distances at all nodes; those next to zero are zero.
template <class G, int D = G::dim>
std::vector<double> distances(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const double> filled,
                              const ImplicitStep<G>& step)
{
  std::vector<unsigned char> has_soil(static_cast<std::size_t>(mesh.owned_cells), 0);
  for (Index c : step.cells)
    has_soil[static_cast<std::size_t>(c)] = 1;
  std::vector<Around> around(filled.size(), Around{});
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (Index node : mesh.cells[c])
    {
      around[node].volume += cell_volume<G>(mesh.shapes[c]) / (D + 1);
      around[node].empty += has_soil[static_cast<std::size_t>(c)] ? 0 : 1;
    }
  sum_shared(exchange, around);
  std::vector<double> result(filled.size(), -1.0);
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    if (around[i].volume == 0)
      continue;
    const double fraction = filled[i] / around[i].volume;
    result[i] = distance(fraction);
    if (std::abs(result[i]) < 1e-3 || (result[i] > 0 && around[i].empty > 0 && fraction < most_at_surface))
      result[i] = 0;
  }
  return result;
}

/// Where the surface cuts the edges of a cell, in its shape functions.
template <int D>
struct Cut
{
  int count = 0;
  std::array<std::array<double, D + 1>, 4> points;
};

template <int D>
Cut<D> cut_of(const std::array<double, D + 1>& d)
{
  Cut<D> cut;
  std::array<int, D + 1> order;
  int inner = 0, outer = D;
  for (int k = 0; k <= D; ++k)
    order[d[k] > 0 ? inner++ : outer--] = k;
  for (int i = 0; i < inner; ++i)
    for (int j = 0; j <= D - inner; ++j)
    {
      const int a = order[i], b = order[i % 2 == 0 ? inner + j : D - j]; // there and back: around a quadrangle
      auto& point = cut.points[cut.count++] = {};
      point[b] = d[a] / (d[a] - d[b]);
      point[a] = 1 - point[b];
    }
  return cut;
}

double triangle_area(const Vector<3>& a, const Vector<3>& b, const Vector<3>& c)
{
  return 0.5 * norm<3>(cross(difference<3>(b, a), difference<3>(c, a)));
}

/// Length or area of the surface in a cell.
template <int D>
double measure(const Mesh<D>& mesh, Index cell, const Cut<D>& cut)
{
  std::array<Vector<D>, 4> x;
  for (int i = 0; i < cut.count; ++i)
    x[i] = point_in_cell<D>(mesh, cell, cut.points[i]);
  if constexpr (D == 2)
    return cut.count < 2 ? 0 : std::hypot(x[1][0] - x[0][0], x[1][1] - x[0][1]);
  else
    return cut.count < 3 ? 0 : triangle_area(x[0], x[1], x[2]) + (cut.count == 4 ? triangle_area(x[0], x[2], x[3]) : 0);
}
} // namespace

template <class G, int D>
void drain_surface(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const double> filled, ImplicitStep<G>& step)
{
  const std::vector<double> d = distances<G>(mesh, exchange, filled, step);
  for (Index c : step.cells)
  {
    std::array<double, D + 1> of_cell;
    for (int k = 0; k <= D; ++k)
      of_cell[k] = d[mesh.cells[c][k]];
    const Cut<D> cut = cut_of<D>(of_cell);
    if (cut.count == 0)
      continue;
    PoreCell<D>& cell = step.pore.cells[c];
    const double h = cell_size<D>(mesh.shapes[c].volume);
    const double per_area = penalty * (cell.flux / h + cell.compliance * h) / volume_of(cell);
    const double each = per_area * measure(mesh, c, cut) * thickness<G>(mesh.shapes[c].centre) / cut.count;
    for (int i = 0; i < cut.count; ++i)
      for (int k = 0; k <= D; ++k)
        for (int l = 0; l <= D; ++l)
          cell.outflow[k][l] += each * cut.points[i][k] * cut.points[i][l];
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void drain_surface(const Mesh<G::dim>&, NodeExchange&, std::span<const double>, ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
