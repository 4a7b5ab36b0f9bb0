#include "model/resting_nodes.h"

#include "transfer/affine_field.h"
#include "transfer/resting.h"

#include <algorithm>
#include <utility>

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
  resting.batches.clear();
  for (std::size_t r = 0; r < resting.runs.size(); r = resting.batches.back().last_run)
    resting.batches.push_back(next_batch(resting.runs, r));
}

namespace
{
/// Numbers of the pairs of vertices of a cell.
template <int D>
using VertexMatrix = std::array<std::array<double, D + 1>, D + 1>;

/// sum m_p N_k N_l over the particles of a cell.
template <class G, int D = G::dim>
VertexMatrix<D> mass_matrix(const CellMoments<G>& moments, const CellShape<D>& shape)
{
  VertexMatrix<D> masses;
  for (int k = 0; k <= D; ++k)
    for (int l = 0; l <= k; ++l)
      masses[k][l] = masses[l][k] =
          sum_of_products<G>({1.0 / (D + 1), shape.gradient[k]}, {1.0 / (D + 1), shape.gradient[l]}, moments);
  return masses;
}

/// Shape functions of the cells.
template <class G, int D = G::dim>
void make_elements(const Mesh<D>& mesh, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  const std::size_t n = resting.runs.size() + lanes;
  resting.vertices.assign(n, {});
  for (auto& column : resting.gradient)
    column.assign(n, 0.0);
  resting.hoop.assign(n, 0.0);
  for (std::size_t r = 0; r < resting.runs.size(); ++r)
  {
    const Index cell = resting.runs[r].cell;
    resting.vertices[r] = mesh.cells[cell];
    for (int k = 0; k < D; ++k)
      for (int b = 0; b < D; ++b)
        resting.gradient[k * D + b][r] = mesh.shapes[cell].gradient[k + 1][b];
    resting.hoop[r] = hoop_gradient<G>(mesh.shapes[cell]);
  }
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

/// The vertices of cells by their nodes: those of nodes[n] are `vertices` from starts[n] on.
struct CellsOfNodes
{
  std::vector<Index> starts;
  std::vector<std::pair<Index, int>> vertices; ///< number of the cell among those that rest, and of its vertex
};

template <int D>
CellsOfNodes cells_of_nodes(std::size_t all_nodes, const RestingCells<D>& resting)
{
  std::vector<Index> place(all_nodes, 0); // first the number of cells, then where the next one goes
  for (std::size_t r = 0; r < resting.runs.size(); ++r)
    for (Index node : resting.vertices[r])
      ++place[node];
  CellsOfNodes found;
  Index count = 0;
  for (Index node : resting.nodes)
  {
    found.starts.push_back(count);
    count += std::exchange(place[node], count);
  }
  found.starts.push_back(count);
  found.vertices.resize(static_cast<std::size_t>(count));
  for (std::size_t r = 0; r < resting.runs.size(); ++r)
    for (int k = 0; k <= D; ++k)
      found.vertices[place[resting.vertices[r][k]]++] = {static_cast<Index>(r), k};
  return found;
}

/// The mass matrix of the nodes, row by row.
/// @pre nodes are known
template <class G, int D = G::dim>
void make_mass_matrix(const Mesh<D>& mesh, VelocityField<G>& field)
{
  RestingCells<D>& resting = field.resting;
  std::vector<VertexMatrix<D>> masses;
  for (const Run& run : resting.runs)
    masses.push_back(mass_matrix(field.moments[run.cell], mesh.shapes[run.cell]));
  const CellsOfNodes cells = cells_of_nodes(mesh.points.size(), resting);
  std::vector<std::size_t> entry_of(mesh.points.size(), 0); // in the row under way, where it is there already
  resting.rows.clear();
  resting.columns.clear();
  resting.masses.clear();
  for (std::size_t n = 0; n < resting.nodes.size(); ++n)
  {
    const std::size_t row = resting.masses.size();
    resting.rows.push_back(static_cast<Index>(row));
    for (Index i = cells.starts[n]; i < cells.starts[n + 1]; ++i)
    {
      const auto [r, k] = cells.vertices[i];
      for (int l = 0; l <= D; ++l)
      {
        const Index node = resting.vertices[r][l];
        std::size_t& entry = entry_of[node];
        if (entry < row || entry >= resting.masses.size() || resting.columns[entry] != node)
        {
          entry = resting.masses.size();
          resting.columns.push_back(node);
          resting.masses.push_back(0);
        }
        resting.masses[entry] += masses[r][k][l];
      }
    }
  }
  resting.rows.push_back(static_cast<Index>(resting.masses.size()));
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
  make_mass_matrix(mesh, field);
  for (auto* values : {&resting.change, &resting.displacement})
    values->assign(mesh.points.size(), {});
  resting.flip_fraction = 1;
  resting.has_gained = resting.is_behind = false;
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
void add_pic_loss(Model<G>& model, double pic_fraction)
{
  if (pic_fraction == 0)
    return;
  update_resting_rows(model);
  const VelocityField<G>& field = model.fields.front();
  for (const Run& run : field.resting.runs)
    model.energy.pic_loss += pic_loss_at_rest(model.particles, field, model.mesh, run, pic_fraction);
}

/// The mass matrix of resting cells times changes of nodal velocities, in the row of one of their nodes
template <int D>
[[gnu::always_inline]] inline Components<D> gain_of_row(const RestingCells<D>& resting,
                                                        std::span<const Vector<D>> change, std::size_t row)
{
  Components<D> gained{};
  for (Index e = resting.rows[row]; e < resting.rows[row + 1]; ++e)
    gained += resting.masses[e] * components<D>(change[resting.columns[e]]);
  return gained;
}

/// `kept` times what was there and a gain.
template <int D>
[[gnu::always_inline]] inline void gain(double kept, const Components<D>& more, Vector<D>& to)
{
  const Components<D> sum = kept * components<D>(to) + more;
  for (int a = 0; a < D; ++a)
    to[a] = sum[a];
}
} // namespace

template <class G>
void gain_resting_momentum(Model<G>& model, double pic_fraction, VelocityField<G>& field,
                           std::span<Vector<G::dim>> momentum)
{
  constexpr int D = G::dim;
  RestingCells<D>& resting = field.resting;
  if (resting.runs.empty())
    return;
  add_pic_loss(model, pic_fraction);
  const double flip = 1 - pic_fraction;
  for (std::size_t n = 0; n < resting.nodes.size(); ++n)
  {
    const Components<D> gained = gain_of_row<D>(resting, field.velocity_change, n);
    const Index i = resting.nodes[n];
    if (!momentum.empty())
      gain<D>(1, gained, momentum[i]);
    gain<D>(flip, gained, resting.sums[i].momentum);
    gain<D>(flip, components<D>(field.velocity_change[i]), resting.change[i]);
  }
  resting.flip_fraction *= flip;
  resting.has_gained = resting.is_behind = true;
}

template <class G>
void add_resting_momentum(const VelocityField<G>& field, std::span<const Vector<G::dim>> change, const MeshPart& part,
                          std::span<Vector<G::dim>> momentum)
{
  const RestingCells<G::dim>& resting = field.resting;
  for (std::size_t n = 0; n < resting.nodes.size(); ++n)
    if (const Index i = resting.nodes[n]; part.has_node[static_cast<std::size_t>(i)])
      gain<G::dim>(1, gain_of_row<G::dim>(resting, change, n), momentum[i]);
}

template <class G>
void move_resting_nodes(Model<G>& model, const PassOptions& options)
{
  constexpr int D = G::dim;
  VelocityField<G>& field = model.fields.front();
  RestingCells<D>& resting = field.resting;
  if (options.move && !resting.has_gained)
    gain_resting_momentum<G>(model, options.pic_fraction, field, {});
  for (Index i : resting.nodes)
    gain<D>(1, options.dt * components<D>(field.velocity[i]), resting.displacement[i]);
  resting.has_gained = false;
  resting.is_behind = true;
}

#define INSTANTIATE(G)                                                                                                 \
  template void take_resting_runs(const Mesh<G::dim>&, std::vector<Run>&, VelocityField<G>&);                          \
  template void make_resting_cells(const Mesh<G::dim>&, const Particles<G::dim>&, VelocityField<G>&);                  \
  template void update_resting_rows(Model<G>&);                                                                        \
  template const MeshPart& part_of_particles(VelocityField<G>&);                                                       \
  template void gain_resting_momentum(Model<G>&, double, VelocityField<G>&, std::span<Vector<G::dim>>);                \
  template void add_resting_momentum(const VelocityField<G>&, std::span<const Vector<G::dim>>, const MeshPart&,        \
                                     std::span<Vector<G::dim>>);                                                       \
  template void move_resting_nodes(Model<G>&, const PassOptions&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
