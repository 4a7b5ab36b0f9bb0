#include "model/resting.h"

#include "base/eigen.h"
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
};

template <int D>
[[noreturn]] void refuse(const Particles<D>& particles, Index p, const std::string& what)
{
  std::ostringstream out;
  out.precision(6);
  out << "particle " << particles.id[p] << " at (";
  for (int i = 0; i < D; ++i)
    out << (i ? ", " : "") << particles.position[i][p];
  out << ") m " << what << ", expected the particles of cells that are to rest as model.seed() places them";
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
    const auto differs = [&](const Column& column) { return std::abs(column[p] - column[first]) > 1e-9 * column[p]; };
    if (particles.id[p] != particles.id[first] + static_cast<GlobalIndex>(k) ||
        particles.material[p] != particles.material[first])
      refuse(particles, p, "shares its cell with particles of another seeding or law");
    if (differs(particles.mass) || differs(particles.volume))
      refuse(particles, p, "has another mass or volume than others in its cell");
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
template <int D>
std::vector<CellRows<D>> rows_of_cells(const Mesh<D>& mesh, const Particles<D>& particles,
                                       std::span<const unsigned char> chosen)
{
  std::vector<std::vector<Index>> rows(static_cast<std::size_t>(mesh.owned_cells));
  for (Index p = 0; p < particles.size(); ++p)
    if (chosen[static_cast<std::size_t>(particles.cell[p])] && !is_resting(particles, p))
      rows[static_cast<std::size_t>(particles.cell[p])].push_back(p);
  std::vector<CellRows<D>> cells;
  std::map<std::size_t, std::vector<std::array<double, D + 1>>> rules;
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    auto& mine = rows[static_cast<std::size_t>(c)];
    if (mine.empty())
      continue;
    std::ranges::sort(mine, {}, [&](Index p) { return particles.id[p]; });
    auto& points = rules[mine.size()];
    try
    {
      if (points.empty())
        points = even_points<D>(static_cast<int>(mine.size()));
    }
    catch (const InputError&)
    {
      refuse(particles, mine.front(), "is one of " + std::to_string(mine.size()) + " in its cell");
    }
    cells.push_back({c, std::move(mine), points});
    check_rows(mesh, particles, cells.back());
  }
  return cells;
}

/// The gradient of the velocities of a cell's particles, by their momentum about its centre.
template <class G, int D = G::dim>
Matrix<D> velocity_gradient(const CellMoments<G>& moments)
{
  Matrix<D> second, gradient;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      second[i][j] = moments.mass_xixi[symmetric_index<D>(i, j)];
  const Eigen::Matrix<double, D, D> found = as_eigen<D>(moments.momentum_xi) * as_eigen<D>(second).inverse();
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
  const auto count = static_cast<double>(cell.rows.size());
  CellMoments<G> moments{};
  for (Index p : cell.rows)
    add_moments<G>(particles, p, p + 1, mesh.shapes[cell.cell], moments);
  for_each_column(particles,
                  [&](std::string_view, int, auto& column)
                  {
                    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(column)>, Column>)
                    {
                      double sum = 0;
                      for (Index p : cell.rows)
                        sum += column.empty() ? 0 : column[p];
                      if (!column.empty())
                        column[row] = sum / count;
                    }
                  });
  particles.mass[row] = moments.mass;
  particles.volume[row] = moments.volume;
  particles.resting[0][row] = count;
  const Matrix<D> gradient = count > 1 ? velocity_gradient<G>(moments) : Matrix<D>{};
  for (int i = 0; i < D; ++i)
  {
    const double displacement = particles.position[i][row] - particles.initial_position[i][row];
    particles.position[i][row] = mesh.shapes[cell.cell].centre[i];
    particles.initial_position[i][row] = mesh.shapes[cell.cell].centre[i] - displacement;
    particles.resting_displacement[i][row] = 0;
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
                 if (G::has_hoop)
                   throw InputError("cells are to rest in axial symmetry, expected plane strain or three dimensions");
                 if (model.fields.size() > 1)
                   throw InputError("cells are to rest in a model of " + std::to_string(model.fields.size()) +
                                    " velocity fields, expected one");
                 cells = rows_of_cells(model.mesh, particles, chosen);
               });
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
