#include "implicit/pore_surface.h"

#include "contact/clearance.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
namespace
{
constexpr double penalty = 100;

/// By how much a pressure at the surface may be on the wrong side [Pa].
constexpr double slack = 1e-3;

/// Filled fraction up to which a node at an empty cell is at the surface, though the cells below may be a little too
/// full; above it the cell is a gap between particles within the soil.
constexpr double most_at_surface = 0.7;

/// Sums over the cells around a node; plain doubles.
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
std::vector<double> distances(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const NodalWater> nodes,
                              const ImplicitStep<G>& step)
{
  std::vector<unsigned char> has_soil(static_cast<std::size_t>(mesh.owned_cells), 0);
  for (Index c : step.cells)
    has_soil[static_cast<std::size_t>(c)] = 1;
  std::vector<Around> around(nodes.size(), Around{});
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (Index node : mesh.cells[c])
    {
      around[node].volume += cell_volume<G>(mesh.shapes[c]) / (D + 1);
      around[node].empty += has_soil[static_cast<std::size_t>(c)] ? 0 : 1;
    }
  sum_shared(exchange, around);
  std::vector<double> result(nodes.size(), -1.0);
  for (std::size_t i = 0; i < result.size(); ++i)
  {
    if (around[i].volume == 0)
      continue;
    const double fraction = nodes[i].volume / around[i].volume;
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

namespace
{
/// Height that the surface gains per length of its upward normal: the area of its plan over its own.
template <int D>
double upward(const Mesh<D>& mesh, Index cell, const std::array<double, D + 1>& distance)
{
  Vector<D> inward{};
  for (int k = 0; k <= D; ++k)
    for (int a = 0; a < D; ++a)
      inward[a] += distance[k] * mesh.shapes[cell].gradient[k][a];
  const double length = norm<D>(inward);
  return length > 0 ? std::max(0.0, -inward[D - 1] / length) : 0;
}

template <int D>
double largest_diagonal(const Matrix<D>& a)
{
  double largest = 0;
  for (int i = 0; i < D; ++i)
    largest = std::max(largest, a[i][i]);
  return largest;
}

/// Outflow over a step by pressure, per area: from the cell's own soil, or from that around its nodes where it has
/// none.
template <class G, int D = G::dim>
double outflow_per_area(const Mesh<D>& mesh, const ImplicitStep<G>& step, std::span<const NodalWater> nodes, Index c)
{
  const PoreCell<D>& cell = step.pore.cells[c];
  const double h = cell_size<D>(mesh.shapes[c].volume), volume = volume_of(cell);
  if (volume > 0)
    return penalty * (largest_diagonal<D>(cell.flux) / h + cell.compliance * h) / volume;
  double largest = 0;
  for (Index node : mesh.cells[c])
    largest = std::max(largest, step.dt * nodes[node].mobility / h + nodes[node].compliance * h);
  return penalty * largest;
}

/// Gives the nodes of soil their parts of a point of the surface in a cell without particles.
template <class G, int D = G::dim>
void add_at_nodes(const Mesh<D>& mesh, const SurfacePoint<D>& point, ImplicitStep<G>& step)
{
  double there = 0;
  for (int k = 0; k <= D; ++k)
    there += step.active[mesh.cells[point.cell][k]] ? point.shape[k] : 0;
  for (int k = 0; k <= D; ++k)
    if (step.active[mesh.cells[point.cell][k]] && point.shape[k] > 0)
    {
      SurfacePoint<D> at_node = point;
      at_node.shape = {};
      at_node.shape[k] = 1;
      at_node.weight *= point.shape[k] / there;
      at_node.rain *= point.shape[k] / there;
      step.pore.surface.push_back(at_node);
    }
}
} // namespace

namespace
{
/// Distance up to which a rigid surface covers one of the soil, over the size of the cells: that is as well as the
/// place of the latter is known.
constexpr double covered = 0.5;

/// Whether a rigid surface, which lets no water through, is where a point of the free surface of a cell is.
template <int D>
bool is_covered(std::span<const Contact<D>> contacts, Index cell, const Vector<D>& x, double size)
{
  const auto covers = [&](const Contact<D>& contact)
  {
    return may_be_near(contact.bounds[static_cast<std::size_t>(cell)], contact.travel + size) &&
           contact::distance<D>(contact.surface, as_at_start<D>(contact.body, x)).value < covered * size;
  };
  return std::ranges::any_of(contacts, covers);
}
} // namespace

template <class G, int D>
void find_surface(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const NodalWater> nodes,
                  const PoreWater& water, std::span<const Contact<D>> contacts, ImplicitStep<G>& step)
{
  const std::vector<double> d = distances<G>(mesh, exchange, nodes, step);
  const double rain = water.rain.empty() ? 0 : step.dt * value_at(water.rain, water.time);
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    const bool has_soil = volume_of(step.pore.cells[c]) > 0;
    std::array<double, D + 1> of_cell;
    for (int k = 0; k <= D; ++k)
      of_cell[k] = d[mesh.cells[c][k]];
    const Cut<D> cut = cut_of<D>(of_cell);
    if (cut.count == 0 || !(has_soil || rain > 0))
      continue;
    const double area = measure(mesh, c, cut) * thickness<G>(mesh.shapes[c].centre) / cut.count;
    const double plan = rain > 0 ? area * upward(mesh, c, of_cell) : 0;
    for (int i = 0; i < cut.count; ++i)
    {
      const Vector<D> x = point_in_cell<D>(mesh, c, cut.points[i]);
      if (is_covered<D>(contacts, c, x, cell_size<D>(mesh.shapes[c].volume)))
        continue;
      const double standing = standing_pressure(water, x[D - 1]);
      const bool open = standing > 0 || !water.may_dry();
      const double weight = area * outflow_per_area(mesh, step, nodes, c);
      SurfacePoint<D> point{c, cut.points[i], weight, standing, rain * plan, open, false};
      // where rain ponds, what enters has left the pressure a little below zero
      point.takes_rain = !open && weight * excess_pressure(mesh, step.pore, point, 0) < -point.rain;
      if (has_soil)
        step.pore.surface.push_back(point);
      else if (!point.open)
        add_at_nodes(mesh, point, step);
    }
  }
}

template <class G, int D>
bool revise_surface(const Mesh<D>& mesh, MPI_Comm comm, ImplicitStep<G>& step)
{
  int revised = 0;
  for (SurfacePoint<D>& point : step.pore.surface)
  {
    if (point.open)
      continue;
    const double excess = excess_pressure(mesh, step.pore, point, step.dt);
    const bool wrong = point.takes_rain ? point.weight * excess > -point.rain + slack * point.weight
                                        : point.weight * excess < -point.rain - slack * point.weight;
    point.takes_rain = point.takes_rain != wrong;
    revised |= wrong;
  }
  MPI_Allreduce(MPI_IN_PLACE, &revised, 1, MPI_INT, MPI_MAX, comm);
  return revised != 0;
}

#define INSTANTIATE(G)                                                                                                 \
  template void find_surface(const Mesh<G::dim>&, NodeExchange&, std::span<const NodalWater>, const PoreWater&,        \
                             std::span<const Contact<G::dim>>, ImplicitStep<G>&);                                      \
  template bool revise_surface(const Mesh<G::dim>&, MPI_Comm, ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
