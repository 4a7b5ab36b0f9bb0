#include "model/resting.h"

#include "model/held_water.h"
#include "model/resting_nodes.h"
#include "particles/seed.h"
#include "transfer/resting.h"

namespace mpm::model
{
namespace
{
/// Puts the particles of a resting cell in its place: the first into its row, the others behind `end`.
template <class G, int D = G::dim>
void divide_row(const Mesh<D>& mesh, const Rule<D>& points, Index row, Index end, Particles<D>& particles)
{
  const Index cell = particles.cell[row];
  const GlobalIndex id = particles.id[row];
  const Vector<D> centre = at<D>(particles.position, row), velocity = at<D>(particles.velocity, row),
                  start = at<D>(particles.initial_position, row);
  const Matrix<D> spin = gradient_at<D>(particles.velocity_gradient, row),
                  strain = gradient_at<D>(particles.displacement_gradient, row);
  const std::vector<double> weights = rule_weights<G>(mesh, cell, points);
  const double mass = particles.mass[row], volume = particles.volume[row];
  particles.resting[0][row] = 0;
  const bool two_phases = particles.water_velocity.present;
  const Vector<D> water_velocity = two_phases ? at<D>(particles.water_velocity.columns, row) : Vector<D>{};
  const Matrix<D> water_spin = two_phases ? gradient_at<D>(particles.water_gradient, row) : Matrix<D>{};
  const double water_mass = two_phases ? particles.water_mass[0][row] : 0;
  for (int k = 0; k < D * D; ++k)
  {
    particles.velocity_gradient[k][row] = particles.displacement_gradient[k][row] = 0;
    if (two_phases)
      particles.water_gradient[k][row] = 0;
  }
  for (int i = 0; i < D; ++i)
    particles.resting_displacement[i][row] = 0;
  const auto copy_to = [&](Index p)
  {
    for_each_column(particles,
                    [=](std::string_view, int, auto& column)
                    {
                      if (!column.empty())
                        column[p] = column[row];
                    });
  };
  for (Index k = 1; k < static_cast<Index>(points.size()); ++k)
    copy_to(end + k - 1);
  for (Index k = 0; k < static_cast<Index>(points.size()); ++k)
  {
    const Index p = k == 0 ? row : end + k - 1;
    particles.id[p] = id + k;
    particles.mass[p] = weights[static_cast<std::size_t>(k)] * mass;
    particles.volume[p] = weights[static_cast<std::size_t>(k)] * volume;
    const Vector<D> x = point_in_cell<D>(mesh, cell, points[static_cast<std::size_t>(k)]);
    for (int i = 0; i < D; ++i)
    {
      particles.position[i][p] = x[i];
      particles.velocity[i][p] = velocity[i];
      particles.initial_position[i][p] = start[i] + x[i] - centre[i];
      for (int j = 0; j < D; ++j)
      {
        particles.velocity[i][p] += spin[i][j] * (x[j] - centre[j]);
        particles.initial_position[i][p] -= strain[i][j] * (x[j] - centre[j]);
      }
    }
    if (two_phases)
    {
      particles.water_mass[0][p] = weights[static_cast<std::size_t>(k)] * water_mass;
      for (int i = 0; i < D; ++i)
      {
        particles.water_velocity[i][p] = water_velocity[i];
        for (int j = 0; j < D; ++j)
          particles.water_velocity[i][p] += water_spin[i][j] * (x[j] - centre[j]);
      }
    }
    if (particles.pore_pressure.present && particles.pressure_gradient.present)
      for (int i = 0; i < D; ++i)
        particles.pore_pressure[0][p] += particles.pressure_gradient[i][p] * (x[i] - centre[i]);
  }
}

/// Lets the particles that have taken the place of a row hold the water that it had.
template <int D>
void hold_water(const PoreWater& water, std::span<const double> weights, double pressure, Index row, Index end,
                Particles<D>& particles)
{
  std::vector<double> pressures{particles.pore_pressure[0][row]};
  const auto others = std::span(particles.pore_pressure[0]).subspan(static_cast<std::size_t>(end), weights.size() - 1);
  pressures.insert(pressures.end(), others.begin(), others.end());
  const double shift = holding_shift(water.retention[static_cast<std::size_t>(particles.material[row])],
                                     particles.saturation[0][row], pressures, weights, pressure, pressure);
  particles.pore_pressure[0][row] += shift;
  for (double& other : others)
    other += shift;
}

/// Largest displacement of the vertices of a resting cell since it began to rest: what its row knows, and what its
/// nodes have moved since.
template <int D>
double largest_displacement(const Mesh<D>& mesh, const Particles<D>& particles, std::span<const Vector<D>> since,
                            Index row)
{
  const Index cell = particles.cell[row];
  const Matrix<D> gradient = gradient_at<D>(particles.displacement_gradient, row);
  double largest = 0;
  for (Index node : mesh.cells[cell])
  {
    Vector<D> u = since[static_cast<std::size_t>(node)];
    for (int i = 0; i < D; ++i)
      u[i] += particles.resting_displacement[i][row];
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        u[i] += gradient[i][j] * (mesh.points[node][j] - mesh.shapes[cell].centre[j]);
    largest = std::max(largest, norm<D>(u));
  }
  return largest;
}

/// Whether the row of a particle or of a resting cell says that its cell may not rest, nor those around it.
template <int D>
bool fails(const Mesh<D>& mesh, const Particles<D>& particles, std::span<const Vector<D>> since, Index p,
           const Conversion& conversion)
{
  if (!particles.state.empty() && particles.state[0][p] > conversion.plastic_strain)
    return true;
  const double size = cell_size<D>(mesh.shapes[particles.cell[p]].volume);
  return is_resting(particles, p) &&
         largest_displacement<D>(mesh, particles, since, p) > conversion.displacement * size;
}

template <int D>
void mark_nodes(const Mesh<D>& mesh, std::span<const unsigned char> cells, std::vector<std::array<double, 1>>& nodes)
{
  for (Index c = 0; c < mesh.owned_cells; ++c)
    if (cells[static_cast<std::size_t>(c)])
      for (Index node : mesh.cells[c])
        nodes[static_cast<std::size_t>(node)][0] = 1;
}
} // namespace

template <class G>
void convert_cells(Model<G>& model, std::span<const unsigned char> chosen)
{
  constexpr int D = G::dim;
  Particles<D>& particles = model.particles;
  Rules<D> rules;
  std::vector<Index> rows;
  Index more = 0;
  for (Index p = 0; p < particles.size(); ++p)
    if (is_resting(particles, p) && chosen[static_cast<std::size_t>(particles.cell[p])])
    {
      const int count = static_cast<int>(particles.resting[0][p]);
      rule_of<D>(count, rules); // fails before anything has changed
      rows.push_back(p);
      more += count - 1;
    }
  if (rows.empty())
    return;
  update_resting_rows(model);
  Index end = particles.size();
  resize(particles, end + more);
  for (Index row : rows)
  {
    const Rule<D>& points = rules.at(static_cast<int>(particles.resting[0][row]));
    const double pressure = particles.pore_pressure.present ? particles.pore_pressure[0][row] : 0;
    divide_row<G>(model.mesh, points, row, end, particles);
    if (model.water && model.water->may_dry())
      hold_water(*model.water, rule_weights<G>(model.mesh, particles.cell[row], points), pressure, row, end, particles);
    end += static_cast<Index>(points.size()) - 1;
  }
  model.totals.converted_cells += static_cast<std::int64_t>(rows.size());
  model.totals.gained_particles += more;
  sort_particles(model);
  make_resting_cells(model.mesh, particles, model.fields.front());
}

template <class G>
void convert_failing(Model<G>& model, const Conversion& conversion)
{
  constexpr int D = G::dim;
  const Mesh<D>& mesh = model.mesh;
  if (!model.particles.resting.present)
    return;
  std::vector<unsigned char> chosen(static_cast<std::size_t>(mesh.owned_cells), 0);
  for (Index p = 0; p < model.particles.size(); ++p)
    if (fails<D>(mesh, model.particles, model.fields.front().resting.displacement, p, conversion))
      chosen[static_cast<std::size_t>(model.particles.cell[p])] = 1;
  std::vector<std::array<double, 1>> nodes(mesh.points.size());
  for (int layer = 0; layer < conversion.layers; ++layer)
  {
    mark_nodes(mesh, chosen, nodes);
    sum_shared(model.exchange, nodes);
    for (Index c = 0; c < mesh.owned_cells; ++c)
      for (Index node : mesh.cells[c])
        if (nodes[static_cast<std::size_t>(node)][0] > 0)
          chosen[static_cast<std::size_t>(c)] = 1;
  }
  convert_cells<G>(model, chosen);
}

#define INSTANTIATE(G)                                                                                                 \
  template void convert_cells(Model<G>&, std::span<const unsigned char>);                                              \
  template void convert_failing(Model<G>&, const Conversion&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
