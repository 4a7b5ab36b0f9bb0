#include "model/resting_nodes.h"

#include "transfer/affine_field.h"
#include "transfer/resting.h"

#include <algorithm>
#include <cmath>

namespace mpm::model
{
template <class G, int D>
void take_resting_runs(const Mesh<D>& mesh, std::vector<Run>& runs, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  resting.marks.assign(static_cast<std::size_t>(mesh.owned_cells), 0);
  resting.runs.clear();
  std::ranges::copy_if(runs, std::back_inserter(resting.runs), &Run::resting);
  std::erase_if(runs, [](const Run& run) { return run.resting; });
  for (const Run& run : resting.runs)
    resting.marks[static_cast<std::size_t>(run.cell)] = 1;
  std::ranges::sort(resting.runs, {}, &Run::cell);
}

namespace
{
/// sum m_p N_k N_l over the particles of a cell.
template <class G, int D = G::dim>
VertexMatrix<D> mass_matrix(const CellMoments<G>& moments, const CellShape<D>& shape)
{
  VertexMatrix<D> masses;
  for (int k = 0; k <= D; ++k)
    for (int l = 0; l <= D; ++l)
      masses[k][l] =
          sum_of_products<G>({1.0 / (D + 1), shape.gradient[k]}, {1.0 / (D + 1), shape.gradient[l]}, moments);
  return masses;
}

/// Whether a matrix has one number on its diagonal and one elsewhere. That of a rule that is the same for all vertices
/// has; not those of eight or 32 points in a tetrahedron, nor any in axial symmetry.
template <int D>
bool is_uniform(const VertexMatrix<D>& masses)
{
  for (int k = 0; k <= D; ++k)
    for (int l = 0; l <= D; ++l)
      if (std::abs(masses[k][l] - masses[0][k == l ? 0 : 1]) > 1e-12 * masses[0][0])
        return false;
  return true;
}

/// Shape functions and masses of the cells.
template <class G, int D = G::dim>
void make_elements(const Mesh<D>& mesh, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  const std::size_t n = resting.runs.size() + lanes;
  resting.vertices.assign(n, {});
  for (auto& column : resting.gradient)
    column.assign(n, 0.0);
  for (auto* column : {&resting.hoop, &resting.mass, &resting.own_mass})
    column->assign(n, 0.0);
  resting.masses.assign(resting.runs.size(), {});
  bool uniform = true;
  for (std::size_t r = 0; r < resting.runs.size(); ++r)
  {
    const Index cell = resting.runs[r].cell;
    resting.vertices[r] = mesh.cells[cell];
    for (int k = 0; k < D; ++k)
      for (int b = 0; b < D; ++b)
        resting.gradient[k * D + b][r] = mesh.shapes[cell].gradient[k + 1][b];
    resting.hoop[r] = hoop_gradient<G>(mesh.shapes[cell]);
    resting.masses[r] = mass_matrix(field.moments[cell], mesh.shapes[cell]);
    resting.mass[r] = resting.masses[r][0][1];
    resting.own_mass[r] = resting.masses[r][0][0] - resting.mass[r];
    uniform = uniform && is_uniform<D>(resting.masses[r]);
  }
  if (uniform)
    resting.masses.clear();
}

template <class G, int D = G::dim>
void sum_nodes(const Mesh<D>& mesh, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  resting.sums.assign(mesh.points.size(), {});
  resting.nodes.clear();
  for (const Run& run : resting.runs)
  {
    const CellMoments<G>& moments = field.moments[run.cell];
    const CellShape<D>& shape = mesh.shapes[run.cell];
    for (int k = 0; k <= D; ++k)
    {
      const Index node = mesh.cells[run.cell][k];
      NodeSums<D>& sums = resting.sums[node];
      if (sums.mass == 0)
        resting.nodes.push_back(node);
      sums.mass += at_vertex<D>(moments.mass, moments.mass_xi, shape.gradient[k]);
      const Vector<D> force = internal_force<G>(moments.stress, shape, k);
      for (int a = 0; a < D; ++a)
      {
        sums.momentum[a] += at_vertex<D>(moments.momentum[a], moments.momentum_xi[a], shape.gradient[k]);
        sums.internal[a] += force[a];
      }
    }
  }
  std::ranges::sort(resting.nodes);
}
} // namespace

template <class G, int D>
void make_resting_cells(const Mesh<D>& mesh, const Particles<D>& particles, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  if (!particles.resting.present)
    return;
  make_elements(mesh, field);
  sum_nodes(mesh, field);
  for (auto* values : {&resting.mapped, &resting.change, &resting.displacement})
    values->assign(mesh.points.size(), {});
  resting.flip_fraction = 1;
  resting.is_mapped = resting.is_behind = false;
  resting.others = {};
}

template <class G>
void update_resting_rows(Model<G>& model)
{
  constexpr int D = G::dim;
  VelocityField<G>& field = model.fields.front();
  RestingCells<D>& resting = field.resting;
  if (!resting.is_behind)
    return;
  const auto change = [&](Index i) -> const Vector<D>& { return resting.change[i]; };
  const auto displacement = [&](Index i) -> const Vector<D>& { return resting.displacement[i]; };
  for (const Run& run : resting.runs)
  {
    const CellMotion<D> motion{resting.flip_fraction, affine_field<D>(model.mesh, run.cell, change),
                               affine_field<D>(model.mesh, run.cell, displacement)};
    move_row<D>(model.particles, run.first, motion);
    take_row<G>(model.particles, run.first, field.moments[run.cell]);
  }
  for (Index node : resting.nodes)
    resting.change[node] = resting.displacement[node] = {};
  resting.flip_fraction = 1;
  resting.is_behind = false;
}

template <class G>
const MeshPart& part_of_particles(VelocityField<G>& field)
{
  RestingCells<G::dim>& resting = field.resting;
  if (resting.runs.empty())
    return field.part;
  MeshPart& others = resting.others;
  if (others.cells.size() + resting.runs.size() != field.part.cells.size() ||
      others.nodes.size() != field.part.nodes.size())
  {
    others = field.part;
    std::erase_if(others.cells, [&](Index c) { return resting.marks[static_cast<std::size_t>(c)] != 0; });
  }
  return others;
}

namespace
{
/// Adds to `mapped` what the masses of the cells make of `velocity_change`.
/// @param gained_by  momentum of vertex k of cell r by the changes of its vertices; a callable
template <class G, class GainedBy>
void map_change(VelocityField<G>& field, GainedBy&& gained_by)
{
  constexpr int D = G::dim;
  RestingCells<D>& resting = field.resting;
  for (std::size_t r = 0; r < resting.runs.size(); ++r)
  {
    const auto& vertices = resting.vertices[r];
    std::array<Components<D>, D + 1> change;
    for (int k = 0; k <= D; ++k)
      change[k] = components<D>(field.velocity_change[vertices[k]]);
    const auto gained = gained_by(r, change);
    for (int k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        resting.mapped[vertices[k]][a] += gained[k][a];
  }
}

template <int D>
using VertexComponents = std::array<Components<D>, D + 1>;

/// By two numbers of a cell.
template <int D>
VertexComponents<D> gained_uniformly(const RestingCells<D>& resting, std::size_t r, const VertexComponents<D>& change)
{
  Components<D> all = change[0];
  for (int k = 1; k <= D; ++k)
    all += change[k];
  all *= resting.mass[r];
  VertexComponents<D> gained;
  for (int k = 0; k <= D; ++k)
    gained[k] = all + resting.own_mass[r] * change[k];
  return gained;
}

/// By the whole matrix of a cell.
template <int D>
VertexComponents<D> gained_by_matrix(const VertexMatrix<D>& masses, const VertexComponents<D>& change)
{
  VertexComponents<D> gained;
  for (int k = 0; k <= D; ++k)
  {
    gained[k] = masses[k][0] * change[0];
    for (int l = 1; l <= D; ++l)
      gained[k] += masses[k][l] * change[l];
  }
  return gained;
}
} // namespace

template <class G>
void map_resting_change(VelocityField<G>& field, std::span<Vector<G::dim>> momentum)
{
  constexpr int D = G::dim;
  RestingCells<D>& resting = field.resting;
  for (Index i : resting.nodes)
    resting.mapped[i] = {};
  if (resting.masses.empty())
    map_change(field, [&](std::size_t r, const auto& change) { return gained_uniformly<D>(resting, r, change); });
  else
    map_change(field,
               [&](std::size_t r, const auto& change) { return gained_by_matrix<D>(resting.masses[r], change); });
  resting.is_mapped = true;
  if (momentum.empty())
    return;
  for (Index i : resting.nodes)
    for (int a = 0; a < D; ++a)
      momentum[i][a] += resting.mapped[i][a];
}

namespace
{
/// Kinetic energy that PIC takes out of a resting cell, whose particles have velocities v + grad v . xi: see
/// `pic_loss` of particles.
template <class G, int D = G::dim>
double pic_loss_at_rest(const Particles<D>& particles, const VelocityField<G>& field, const Mesh<D>& mesh,
                        const Run& run, double pic_fraction)
{
  const auto start = [&](Index i) -> const Vector<D>& { return field.start_velocity[i]; };
  const AffineField<D> nodal = affine_field<D>(mesh, run.cell, start);
  const Matrix<D> gradient = gradient_at<D>(particles.velocity_gradient, run.first);
  double sum = 0;
  for (int a = 0; a < D; ++a)
  {
    AffineScalar<D> half{particles.velocity[a][run.first], gradient[a]}, change;
    change.value = pic_fraction * (half.value - nodal.value[a]);
    half.value -= 0.5 * change.value;
    for (int b = 0; b < D; ++b)
    {
      change.gradient[b] = pic_fraction * (half.gradient[b] - nodal.gradient[a][b]);
      half.gradient[b] -= 0.5 * change.gradient[b];
    }
    sum += sum_of_products<G>(change, half, field.moments[run.cell]);
  }
  return sum;
}

template <class G>
void add_pic_loss(Model<G>& model, const PassOptions& options)
{
  if (options.pic_fraction == 0)
    return;
  update_resting_rows(model);
  const VelocityField<G>& field = model.fields.front();
  for (const Run& run : field.resting.runs)
    model.energy.pic_loss += pic_loss_at_rest(model.particles, field, model.mesh, run, options.pic_fraction);
}

/// The gains of the nodes in a step: momentum, and velocities and displacements that the rows do not know yet.
template <class G, int D = G::dim>
void move_nodes(const PassOptions& options, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  if (!resting.is_mapped)
    map_resting_change<G>(field, {});
  const double flip = 1 - options.pic_fraction;
  for (Index i : resting.nodes)
    for (int a = 0; a < D; ++a)
    {
      resting.sums[i].momentum[a] = flip * resting.sums[i].momentum[a] + resting.mapped[i][a];
      resting.change[i][a] = flip * resting.change[i][a] + field.velocity_change[i][a];
      resting.displacement[i][a] += options.dt * field.velocity[i][a];
    }
  resting.flip_fraction *= flip;
  resting.is_mapped = false;
  resting.is_behind = true;
}
} // namespace

template <class G>
void move_resting_nodes(Model<G>& model, const PassOptions& options)
{
  add_pic_loss(model, options);
  move_nodes(options, model.fields.front());
}

#define INSTANTIATE(G)                                                                                                 \
  template void take_resting_runs(const Mesh<G::dim>&, std::vector<Run>&, VelocityField<G>&);                          \
  template void make_resting_cells(const Mesh<G::dim>&, const Particles<G::dim>&, VelocityField<G>&);                  \
  template void update_resting_rows(Model<G>&);                                                                        \
  template const MeshPart& part_of_particles(VelocityField<G>&);                                                       \
  template void map_resting_change(VelocityField<G>&, std::span<Vector<G::dim>>);                                      \
  template void move_resting_nodes(Model<G>&, const PassOptions&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
