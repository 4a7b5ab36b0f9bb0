#include "model/moving_cells.h"

#include "model/mapping.h"
#include "model/moving_limits.h"
#include "model/placement.h"

#include <map>
#include <utility>

namespace mpm::model
{
namespace
{
/// Gives the nodes with too little mass for a velocity of their own the mean of those of the other vertices of their
/// cells, so that they stay where they are in the body. Nothing else depends on their places.
template <class G, int D = G::dim>
void move_light_nodes(const VelocityField<G>& field, double dt, Mesh<D>& mesh)
{
  std::map<Index, std::pair<Vector<D>, int>> sums;
  for_each_light_vertex(mesh, field, field.velocity,
                        [&](Index node, const Vector<D>& mean)
                        {
                          auto& [velocity, count] = sums[node];
                          for (int a = 0; a < D; ++a)
                            velocity[a] += mean[a];
                          ++count;
                        });
  for (const auto& [node, sum] : sums)
    for (int a = 0; a < D; ++a)
      mesh.points[node][a] += dt * sum.first[a] / sum.second;
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
        left[a] += dt * value_of_vertex(mesh, field, field.velocity, c, k)[a] / (D + 1);
    move<G>(field.moments[c], {1, {}, {left, {}}});
  }
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
