#include "model/moving_limits.h"

#include "mesh/search.h"
#include "parallel/agreement.h"

#include <algorithm>
#include <cmath>
#include <limits>
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
void find_watched_nodes(Model<G>& model)
{
  constexpr int D = G::dim;
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

#define INSTANTIATE(G)                                                                                                 \
  template void find_watched_nodes(Model<G>&);                                                                         \
  template std::string end_of_moving_cells(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
