#include "model/resting.h"

#include "base/eigen.h"
#include "model/affine.h"
#include "parallel/agreement.h"
#include "particles/seed.h"
#include "transfer/resting.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace mpm::model
{
namespace
{
/// Rows of the particles of a cell, by rising number, and the rule that they are to form.
template <int D>
struct CellRows
{
  Index cell;
  std::vector<Index> rows;
  std::vector<std::array<double, D + 1>> points;
  std::vector<double> weights; ///< of the points
};

template <int D>
[[noreturn]] void refuse(const Particles<D>& particles, Index p, const std::string& what)
{
  std::ostringstream out;
  out.precision(6);
  out << "particle " << particles.id[p] << " at (";
  for (int i = 0; i < D; ++i)
    out << (i ? ", " : "") << particles.position[i][p];
  out << ") m " << what << ", expected in each resting cell the particles as model.seed() places them";
  throw InputError(out.str());
}

/// @throws InputError where the particles of a cell are not those of one call of `seed_cells`, or differ
template <int D>
void check_rows(const Mesh<D>& mesh, const Particles<D>& particles, const CellRows<D>& cell)
{
  const Index first = cell.rows.front();
  const double size = cell_size<D>(mesh.shapes[cell.cell].volume);
  for (std::size_t k = 0; k < cell.rows.size(); ++k)
  {
    const Index p = cell.rows[k];
    const double ratio = cell.weights[k] / cell.weights[0];
    const auto differs = [&](const Column& column)
    { return std::abs(column[p] - ratio * column[first]) > 1e-9 * column[p]; };
    if (particles.id[p] != particles.id[first] + static_cast<GlobalIndex>(k) ||
        particles.material[p] != particles.material[first])
      refuse(particles, p, "shares its cell with particles of another seeding or law");
    if (differs(particles.mass) || differs(particles.volume))
      refuse(particles, p, "has another mass or volume than its place in the cell gives it beside the others");
    if (particles.traction.present && norm<D>(at<D>(particles.traction.columns, p)) > 0)
      refuse(particles, p, "carries a traction");
    Vector<D> off = at<D>(particles.position, p);
    const Vector<D> point = point_in_cell<D>(mesh, cell.cell, cell.points[k]);
    for (int i = 0; i < D; ++i)
      off[i] -= point[i];
    if (norm<D>(off) > 1e-9 * size)
      refuse(particles, p, "is not at its place in the cell");
  }
}

/// The cells that are to rest, with their rows.
/// @throws InputError see `rest_cells`
template <class G, int D = G::dim>
std::vector<CellRows<D>> rows_of_cells(const Mesh<D>& mesh, const Particles<D>& particles,
                                       std::span<const unsigned char> chosen)
{
  std::vector<std::vector<Index>> rows(static_cast<std::size_t>(mesh.owned_cells));
  for (Index p = 0; p < particles.size(); ++p)
    if (chosen[static_cast<std::size_t>(particles.cell[p])] && !is_resting(particles, p))
      rows[static_cast<std::size_t>(particles.cell[p])].push_back(p);
  std::vector<CellRows<D>> cells;
  Rules<D> rules;
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    auto& mine = rows[static_cast<std::size_t>(c)];
    if (mine.empty())
      continue;
    std::ranges::sort(mine, {}, [&](Index p) { return particles.id[p]; });
    try
    {
      const Rule<D>& points = rule_of<D>(static_cast<int>(mine.size()), rules);
      cells.push_back({c, std::move(mine), points, rule_weights<G>(mesh, c, points)});
    }
    catch (const InputError&)
    {
      refuse(particles, mine.front(), "is one of " + std::to_string(mine.size()) + " in its cell");
    }
    check_rows(mesh, particles, cells.back());
  }
  return cells;
}

/// The gradient of the velocities of a cell's particles, by their momentum about the centre of mass.
template <class G, int D = G::dim>
Matrix<D> velocity_gradient(const CellMoments<G>& moments)
{
  Matrix<D> second, about, gradient;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
    {
      const double from_centre = moments.mass_xi[j] / moments.mass;
      second[i][j] = moments.mass_xixi[symmetric_index<D>(i, j)] - moments.mass_xi[i] * from_centre;
      about[i][j] = moments.momentum_xi[i][j] - moments.momentum[i] * from_centre;
    }
  const Eigen::Matrix<double, D, D> found = as_eigen<D>(about) * as_eigen<D>(second).inverse();
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      gradient[i][j] = found(i, j);
  return gradient;
}

/// Makes the first row of a cell that of the resting cell; the others are to be removed.
template <class G, int D = G::dim>
void merge_rows(const Mesh<D>& mesh, const CellRows<D>& cell, Particles<D>& particles)
{
  const Index row = cell.rows.front();
  CellMoments<G> moments{};
  for (Index p : cell.rows)
    add_moments<G>(particles, p, p + 1, mesh.shapes[cell.cell], moments);
  for_each_column(particles,
                  [&](std::string_view, int, auto& column)
                  {
                    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(column)>, Column>)
                    {
                      if (column.empty())
                        return;
                      double mean = 0;
                      for (std::size_t k = 0; k < cell.rows.size(); ++k)
                        mean += cell.weights[k] * column[cell.rows[k]];
                      column[row] = mean;
                    }
                  });
  particles.mass[row] = moments.mass;
  particles.volume[row] = moments.volume;
  particles.resting[0][row] = static_cast<double>(cell.rows.size());
  const Matrix<D> gradient = cell.rows.size() > 1 ? velocity_gradient<G>(moments) : Matrix<D>{};
  Vector<D> to_centre; // from the centre of mass, where the means are
  for (int i = 0; i < D; ++i)
    to_centre[i] = -moments.mass_xi[i] / moments.mass;
  if (particles.pore_pressure.present && particles.pressure_gradient.present)
    particles.pore_pressure[0][row] += dot<D>(at<D>(particles.pressure_gradient.columns, row), to_centre);
  for (int i = 0; i < D; ++i)
  {
    const double displacement = particles.position[i][row] - particles.initial_position[i][row];
    particles.position[i][row] = mesh.shapes[cell.cell].centre[i];
    particles.initial_position[i][row] = mesh.shapes[cell.cell].centre[i] - displacement;
    particles.resting_displacement[i][row] = 0;
    particles.velocity[i][row] += dot<D>(gradient[i], to_centre);
    for (int j = 0; j < D; ++j)
    {
      particles.velocity_gradient[i * D + j][row] = gradient[i][j];
      particles.displacement_gradient[i * D + j][row] = 0;
    }
  }
}
} // namespace

template <class G>
void rest_cells(Model<G>& model, std::span<const unsigned char> chosen)
{
  constexpr int D = G::dim;
  Particles<D>& particles = model.particles;
  std::vector<CellRows<D>> cells;
  collectively(model.exchange.comm,
               [&]
               {
                 if (model.fields.size() > 1)
                   throw InputError("resting cells are not supported in a model of " +
                                    std::to_string(model.fields.size()) + " velocity fields, expected one");
                 cells = rows_of_cells<G>(model.mesh, particles, chosen);
               });
  begin_transfer(model, Transfer::flip);
  require(particles.resting, particles.id.size());
  require(particles.velocity_gradient, particles.id.size());
  require(particles.resting_displacement, particles.id.size());
  require(particles.displacement_gradient, particles.id.size());
  std::vector<Index> gone;
  for (const CellRows<D>& cell : cells)
  {
    merge_rows<G>(model.mesh, cell, particles);
    gone.insert(gone.end(), cell.rows.begin() + 1, cell.rows.end());
  }
  std::ranges::sort(gone);
  remove<D>(particles, gone);
  model.ready = false;
  model.energy.stale = true;
}

#define INSTANTIATE(G) template void rest_cells(Model<G>&, std::span<const unsigned char>);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
