#include "model/resting.h"

#include "base/eigen.h"
#include "model/affine.h"
#include "model/held_water.h"
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

/// Mass of a particle without the water that comes and goes in soil that may dry.
template <int D>
double dry_mass(const Particles<D>& particles, const std::optional<PoreWater>& water, Index p)
{
  if (!water || !water->may_dry())
    return particles.mass[p];
  return particles.mass[p] -
         water->density * particles.saturation[0][p] * particles.porosity[0][p] * particles.volume[p];
}

/// @throws InputError where the particles of a cell are not those of one call of `seed_cells`, or differ
template <int D>
void check_rows(const Mesh<D>& mesh, const Particles<D>& particles, const std::optional<PoreWater>& water,
                const CellRows<D>& cell)
{
  const Index first = cell.rows.front();
  const double size = cell_size<D>(mesh.shapes[cell.cell].volume);
  for (std::size_t k = 0; k < cell.rows.size(); ++k)
  {
    const Index p = cell.rows[k];
    const double ratio = cell.weights[k] / cell.weights[0];
    const auto differ = [&](double mine, double of_first) { return std::abs(mine - ratio * of_first) > 1e-9 * mine; };
    if (particles.id[p] != particles.id[first] + static_cast<GlobalIndex>(k) ||
        particles.material[p] != particles.material[first])
      refuse(particles, p, "shares its cell with particles of another seeding or law");
    if (differ(dry_mass(particles, water, p), dry_mass(particles, water, first)) ||
        differ(particles.volume[p], particles.volume[first]))
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
                                       const std::optional<PoreWater>& water, std::span<const unsigned char> chosen)
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
    check_rows(mesh, particles, water, cells.back());
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

/// Water with its own velocity in a cell that is to rest.
template <int D>
struct WaterAtRest
{
  double mass;
  Vector<D> velocity; ///< at the centre of the cell
  Matrix<D> gradient;
};

/// The water of a cell's particles as one: with their momentum, and its first moment.
template <class G, int D = G::dim>
WaterAtRest<D> water_at_rest(const Mesh<D>& mesh, const CellRows<D>& cell, const Particles<D>& particles)
{
  CellMoments<G> moments{};
  for (Index p : cell.rows)
  {
    const double mass = particles.water_mass[0][p];
    Vector<D> xi = at<D>(particles.position, p);
    for (int i = 0; i < D; ++i)
      xi[i] -= mesh.shapes[cell.cell].centre[i];
    moments.mass += mass;
    for (int k = 0; k < n_symmetric<D>; ++k)
      moments.mass_xixi[k] += mass * xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
    for (int a = 0; a < D; ++a)
    {
      const double momentum = mass * particles.water_velocity[a][p];
      moments.mass_xi[a] += mass * xi[a];
      moments.momentum[a] += momentum;
      for (int b = 0; b < D; ++b)
        moments.momentum_xi[a][b] += momentum * xi[b];
    }
  }
  WaterAtRest<D> water{moments.mass, {}, cell.rows.size() > 1 ? velocity_gradient<G>(moments) : Matrix<D>{}};
  for (int a = 0; a < D; ++a) // the masses of resting cells have no first moment: none of momentum goes into it
    water.velocity[a] = moments.momentum[a] / moments.mass;
  return water;
}

/// Makes the first row of a cell that of the resting cell; the others are to be removed.
template <class G, int D = G::dim>
void merge_rows(const Mesh<D>& mesh, const CellRows<D>& cell, Particles<D>& particles)
{
  const Index row = cell.rows.front();
  CellMoments<G> moments{};
  for (Index p : cell.rows)
    add_moments<G>(particles, p, p + 1, mesh.shapes[cell.cell], moments);
  const bool two_phases = particles.water_velocity.present;
  const WaterAtRest<D> water = two_phases ? water_at_rest<G>(mesh, cell, particles) : WaterAtRest<D>{};
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
  if (two_phases)
  {
    particles.water_mass[0][row] = water.mass;
    for (int i = 0; i < D; ++i)
    {
      particles.water_velocity[i][row] = water.velocity[i];
      for (int j = 0; j < D; ++j)
        particles.water_gradient[i * D + j][row] = water.gradient[i][j];
    }
  }
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
/// Least and largest pore pressure of some particles.
template <int D>
std::array<double, 2> pressure_range(const Particles<D>& particles, const std::vector<Index>& rows)
{
  std::array<double, 2> range{particles.pore_pressure[0][rows.front()], particles.pore_pressure[0][rows.front()]};
  for (Index p : rows)
    range = {std::min(range[0], particles.pore_pressure[0][p]), std::max(range[1], particles.pore_pressure[0][p])};
  return range;
}

/// Lets the row of a resting cell hold the water of its particles, whose pressures were in a range.
template <int D>
void hold_water(const PoreWater& water, double least, double largest, Index row, Particles<D>& particles)
{
  double& pressure = particles.pore_pressure[0][row];
  pressure += holding_shift(water.retention[static_cast<std::size_t>(particles.material[row])],
                            particles.saturation[0][row], std::array{pressure}, std::array{1.0}, least, largest);
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
                 cells = rows_of_cells<G>(model.mesh, particles, model.water, chosen);
               });
  if (!particles.resting.present) // gradients of an affine transfer
    particles.velocity_gradient = {};
  require(particles.resting, particles.id.size());
  require(particles.velocity_gradient, particles.id.size());
  require(particles.resting_displacement, particles.id.size());
  if (particles.water_velocity.present)
    require(particles.water_gradient, particles.id.size());
  require(particles.displacement_gradient, particles.id.size());
  const bool dries = model.water && model.water->may_dry();
  std::vector<Index> gone;
  for (const CellRows<D>& cell : cells)
  {
    const auto [least, largest] = dries ? pressure_range(particles, cell.rows) : std::array<double, 2>{};
    merge_rows<G>(model.mesh, cell, particles);
    if (dries)
      hold_water(*model.water, least, largest, cell.rows.front(), particles);
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
