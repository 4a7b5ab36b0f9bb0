#include "model/moving_cells.h"

#include "mesh/search.h"
#include "model/mapping.h"
#include "model/placement.h"
#include "parallel/agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>
#include <utility>

namespace mpm::model
{
namespace
{
/// Calls `work` with the initial places of the nodes in the mesh.
template <int D, class Work>
void with_initial_mesh(Mesh<D>& mesh, MovedCells<D>& moved, Work&& work)
{
  const auto exchange = [&]
  {
    std::swap(mesh.points, moved.initial_points);
    std::swap(mesh.shapes, moved.initial_shapes);
  };
  exchange();
  work();
  exchange();
}

/// Gives the nodes with too little mass for a velocity of their own the mean of those of the other vertices of their
/// cells, so that they stay where they are in the body. Nothing else depends on their places.
template <class G, int D = G::dim>
void move_light_nodes(const VelocityField<G>& field, double dt, Mesh<D>& mesh)
{
  std::map<Index, std::pair<Vector<D>, int>> sums;
  for (Index c : field.part.cells)
    for (Index node : mesh.cells[c])
      if (field.moments[c].mass > 0 && is_light(field, node))
      {
        auto& [velocity, count] = sums[node];
        const Vector<D> mean = mean_of_heavy_nodes(mesh, field, c);
        for (int a = 0; a < D; ++a)
          velocity[a] += mean[a];
        ++count;
      }
  for (const auto& [node, sum] : sums)
    for (int a = 0; a < D; ++a)
      mesh.points[node][a] += dt * sum.first[a] / sum.second;
}

/// What the cells with particles of this rank have become.
struct Flatness
{
  Index distorted = none; ///< a cell that is too distorted, also where the place of a node is not a number
  double smallest_altitude = std::numeric_limits<double>::infinity(); ///< [m]
};

template <class G>
Flatness flatness_of_cells(const Model<G>& model)
{
  const VelocityField<G>& field = model.fields.front();
  Flatness found;
  for (Index c : field.part.cells)
  {
    if (field.moments[c].mass == 0)
      continue;
    const double altitude = smallest_altitude(model.mesh.shapes[c]);
    if (!(altitude > least_altitude * smallest_altitude(model.moved_cells.initial_shapes[c])))
      found.distorted = c;
    found.smallest_altitude = std::min(found.smallest_altitude, altitude);
  }
  return found;
}

/// The largest speed of a node of this rank [m/s].
template <class G>
double largest_speed(const VelocityField<G>& field)
{
  double squared = 0;
  for (Index i : field.part.nodes)
    squared = std::max(squared, dot<G::dim>(field.velocity[i], field.velocity[i]));
  return std::sqrt(squared);
}

/// The nodes that may meet the boundary of the mesh first: those at the surface of the body that are not on it at the
/// start, and that no boundary condition holds; each with a cell around it.
/// @note Collective
template <class G, int D = G::dim>
void find_watched_nodes(Model<G>& model)
{
  const Mesh<D>& mesh = model.mesh;
  const VelocityField<G>& field = model.fields.front();
  std::vector<double> is_at_surface(mesh.points.size(), 0), is_on_boundary = is_at_surface;
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (int k = 0; k <= D; ++k)
    {
      if (field.moments[c].mass == 0)
        is_at_surface[static_cast<std::size_t>(mesh.cells[c][k])] = 1;
      if (mesh.neighbours[c][k] == none)
        for (Index node : facet_nodes<D>(mesh.cells[c], k))
          is_on_boundary[static_cast<std::size_t>(node)] = 1;
    }
  max_shared(model.exchange, is_at_surface);
  max_shared(model.exchange, is_on_boundary);
  for (const Support<D>& support : field.supports)
    is_on_boundary[static_cast<std::size_t>(support.node)] = 1;
  model.moved_cells.watched.clear();
  model.moved_cells.watched_cells.clear();
  for (Index c : field.part.cells)
    for (Index node : mesh.cells[c])
      if (const auto i = static_cast<std::size_t>(node);
          field.moments[c].mass > 0 && is_on_boundary[i] == 0 && std::exchange(is_at_surface[i], 0) > 0)
      {
        model.moved_cells.watched.push_back(node);
        model.moved_cells.watched_cells.push_back(c);
      }
}

/// A watched node that will leave the initial mesh within a time [s] if it goes on as it moves, or `none`, on this
/// rank.
/// @note Collective
template <class G, int D = G::dim>
Index leaving_node(Model<G>& model, double within)
{
  Mesh<D>& mesh = model.mesh;
  auto& moved = model.moved_cells;
  std::vector<LostPoint<D>> ahead, lost;
  std::vector<Index> lost_nodes;
  for (std::size_t k = 0; k < moved.watched.size(); ++k)
  {
    const Index i = moved.watched[k];
    Vector<D> place = mesh.points[i];
    for (int a = 0; a < D; ++a)
      place[a] += within * model.fields.front().velocity[i][a];
    ahead.push_back({place, moved.watched_cells[k]});
  }
  FarSearch found;
  const auto search = [&]
  {
    for (std::size_t k = 0; k < ahead.size(); ++k)
    {
      const Index cell = find_cell<D>(mesh, ahead[k].position, ahead[k].start).cell;
      if (cell != none && cell < mesh.owned_cells)
      {
        moved.watched_cells[k] = cell;
        continue;
      }
      lost.push_back(ahead[k]);
      lost_nodes.push_back(moved.watched[k]);
    }
    int any = !lost.empty();
    MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, model.exchange.comm);
    if (any)
      found = find_far<D>(mesh, model.migration.owned_cells, model.exchange, lost);
  };
  with_initial_mesh(mesh, moved, search);
  for (std::size_t k = 0; k < found.places.size(); ++k)
    if (found.places[k].cell == none)
      return lost_nodes[k];
  return none;
}
/// What is in the way, in words.
template <class G>
std::string obstacle(const Model<G>& model, Index distorted, Index leaving)
{
  if (distorted == none && leaving == none)
    return "";
  std::ostringstream out;
  out.precision(6);
  out << (distorted != none ? "the cell around (" : "the body at (");
  const auto& place = distorted != none ? model.mesh.shapes[distorted].centre : model.mesh.points[leaving];
  for (std::size_t a = 0; a < place.size(); ++a)
    out << (a ? ", " : "") << place[a];
  if (distorted != none)
    out << ") m has less than " << least_altitude << " of its initial altitude left";
  else
    out << ") m is about to meet the boundary of the mesh, whose boundary conditions it would not feel";
  return out.str();
}
} // namespace

template <class G>
void begin_moving_cells(Model<G>& model)
{
  auto& moved = model.moved_cells;
  if (moved.initial_points.empty())
  {
    moved.initial_points = model.mesh.points;
    moved.initial_shapes = model.mesh.shapes;
  }
  find_watched_nodes(model);
}

template <class G>
void move_cells(Model<G>& model, double dt)
{
  constexpr int D = G::dim;
  Mesh<D>& mesh = model.mesh;
  VelocityField<G>& field = model.fields.front();
  for (Index i : field.part.nodes)
    for (int a = 0; a < D; ++a)
      mesh.points[i][a] += dt * field.velocity[i][a];
  if (field.has_light_nodes)
    move_light_nodes(field, dt, mesh);
  for (Index c : field.part.cells)
  {
    const Vector<D> centre = mesh.shapes[c].centre;
    mesh.shapes[c] = shape_of_cell(mesh, c);
    if (!field.has_light_nodes || field.moments[c].mass == 0)
      continue;
    Vector<D> left = difference<D>(centre, mesh.shapes[c].centre); // of the motion that the particles have had
    for (int k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        left[a] += dt * velocity_of_vertex(mesh, field, c, k)[a] / (D + 1);
    move<G>(field.moments[c], {1, {}, {left, {}}});
  }
}

template <class G>
std::string end_of_moving_cells(Model<G>& model)
{
  auto& moved = model.moved_cells;
  const Flatness cells = flatness_of_cells(model);
  std::array<double, 3> largest{cells.distorted == none ? 0.0 : 1.0, 1 / cells.smallest_altitude,
                                largest_speed(model.fields.front())};
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), 3, MPI_DOUBLE, MPI_MAX, model.exchange.comm);
  const double rate = largest[1] * largest[2];
  moved.travel += rate * model.last.dt;
  const bool looks = moved.travel > longest_travel;
  if (largest[0] == 0 && !looks)
    return "";
  Index leaving = none;
  if (looks)
  {
    leaving =
        leaving_node(model, 2 * longest_travel / rate); // twice the time to the next look: no node is outside then
    moved.travel = 0;
  }
  const std::string text = parallel::shared_failure(model.exchange.comm, obstacle(model, cells.distorted, leaving));
  if (text.empty())
    return "";
  return "cells cannot move with the body any further at t = " + std::to_string(model.time) + " s: " + text +
         "; a run with moving_cells=False goes on from here";
}

template <class G>
void reset_cells(Model<G>& model)
{
  constexpr int D = G::dim;
  auto& moved = model.moved_cells;
  if (moved.initial_points.empty())
    return;
  model.mesh.points = std::move(moved.initial_points);
  model.mesh.shapes = std::move(moved.initial_shapes);
  moved = {};
  std::vector<double> positions;
  positions.reserve(model.particles.id.size() * D);
  for (Index p = 0; p < model.particles.size(); ++p)
    for (double x : at<D>(model.particles.position, p))
      positions.push_back(x);
  try
  {
    place_particles<G>(model, positions);
  }
  catch (const InputError& error) // on all ranks alike
  {
    throw RunError("cells that had moved with the body went back at t = " + std::to_string(model.time) +
                   " s: " + error.what() + "; extend the mesh");
  }
}

template <int D>
Table no_moved_corners()
{
  return {"moved_corners", D * (D + 1) + 1, {}};
}

template <class G, int D>
Table moved_corners(const Model<G>& model)
{
  Table table = no_moved_corners<D>();
  const VelocityField<G>& field = model.fields.front();
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    if (field.moments[c].mass == 0)
      continue;
    table.values.push_back(static_cast<double>(model.mesh.global_cells[static_cast<std::size_t>(c)]));
    for (Index node : model.mesh.cells[c])
      for (double x : model.mesh.points[node])
        table.values.push_back(x);
  }
  return table;
}

template <class G, int D>
Mesh<D> initial_mesh(const Model<G>& model)
{
  Mesh<D> mesh = model.mesh;
  if (const auto& moved = model.moved_cells; !moved.initial_points.empty())
  {
    mesh.points = moved.initial_points;
    mesh.shapes = moved.initial_shapes;
  }
  return mesh;
}

template <int D>
MovedCells<D> take_corners(const std::unordered_map<GlobalIndex, Index>& owned, const Table& corners, Mesh<D>& mesh)
{
  MovedCells<D> moved{mesh.points, mesh.shapes, {}, {}, 0};
  const auto width = static_cast<std::size_t>(corners.width);
  for (std::size_t row = 0; row < corners.values.size(); row += width)
  {
    const Index c = owned.at(static_cast<GlobalIndex>(corners.values[row]));
    const double* x = &corners.values[row + 1];
    for (Index node : mesh.cells[c])
      for (int a = 0; a < D; ++a)
        mesh.points[node][a] = *x++;
    mesh.shapes[c] = shape_of_cell(mesh, c);
  }
  return moved;
}

#define INSTANTIATE(G)                                                                                                 \
  template void begin_moving_cells(Model<G>&);                                                                         \
  template void move_cells(Model<G>&, double);                                                                         \
  template std::string end_of_moving_cells(Model<G>&);                                                                 \
  template void reset_cells(Model<G>&);                                                                                \
  template Table moved_corners(const Model<G>&);                                                                       \
  template Mesh<G::dim> initial_mesh(const Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
template Table no_moved_corners<2>();
template Table no_moved_corners<3>();
template MovedCells<2> take_corners(const std::unordered_map<GlobalIndex, Index>&, const Table&, Mesh<2>&);
template MovedCells<3> take_corners(const std::unordered_map<GlobalIndex, Index>&, const Table&, Mesh<3>&);
} // namespace mpm::model
