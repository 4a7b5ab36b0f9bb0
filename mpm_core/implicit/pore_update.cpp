#include "implicit/pore_update.h"

#include "base/eigen.h"
#include "implicit/pore_water.h"
#include "model/integration.h"
#include "transfer/resting.h"

#include <cmath>

namespace mpm::implicit
{
namespace
{
/// Linear pressures of a cell: increment at its centre, its gradient, and that of the pressure at the end as the
/// cell has moved.
template <int D>
struct CellPressure
{
  double increment = 0;
  Vector<D> of_increment{}, at_end{};
};

/// grad p at the end: F^-T times that over the cell as it was, F = 1 + grad u.
template <class G>
Vector<G::dim> in_moved_cell(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                             Index cell, const Vector<G::dim>& gradient)
{
  constexpr int D = G::dim;
  if (step.options.hold_positions)
    return gradient;
  Matrix<D> f{};
  for (int a = 0; a < D; ++a)
  {
    f[a][a] = 1;
    for (int b = 0; b < D; ++b)
      for (int k = 0; k <= D; ++k)
        f[a][b] += step.dt * field.velocity[mesh.cells[cell][k]][a] * mesh.shapes[cell].gradient[k][b];
  }
  const Eigen::Matrix<double, D, 1> old = Eigen::Map<const Eigen::Matrix<double, D, 1>>(gradient.data());
  const Eigen::Matrix<double, D, 1> now = as_eigen<D>(f).transpose().inverse() * old;
  Vector<D> moved;
  for (int a = 0; a < D; ++a)
    moved[a] = now[a];
  return moved;
}

template <class G, int D = G::dim>
CellPressure<D> cell_pressure(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                              Index cell)
{
  const PoreStep<D>& pore = step.pore;
  CellPressure<D> pressure;
  Vector<D> at_end{};
  for (int k = 0; k <= D; ++k)
  {
    const Index node = mesh.cells[cell][k];
    const double increment = step.dt * pore.rate[node];
    pressure.increment += increment / (D + 1);
    for (int a = 0; a < D; ++a)
    {
      pressure.of_increment[a] += increment * mesh.shapes[cell].gradient[k][a];
      at_end[a] += end_pressure(pore, node, step.dt) * mesh.shapes[cell].gradient[k][a];
    }
  }
  pressure.at_end = in_moved_cell(mesh, field, step, cell, at_end);
  return pressure;
}

/// Kozeny and Carman's factor of the conductivity.
double kozeny_carman(double porosity) { return porosity * porosity * porosity / ((1 - porosity) * (1 - porosity)); }

template <int D>
void grow_pores(Particles<D>& particles, Index first, Index last, double growth, bool follows)
{
  for (Index p = first; p < last; ++p)
  {
    const double before = particles.porosity[0][p], after = 1 - (1 - before) / growth;
    particles.porosity[0][p] = after;
    if (follows)
      particles.conductivity[0][p] *= kozeny_carman(after) / kozeny_carman(before);
  }
}

/// Mean over the particles of a resting cell of the product of pressure, as it is half way, and increment.
template <class G, int D = G::dim>
double mean_product(const Particles<D>& particles, Index row, const CellMoments<G>& moments,
                    const CellPressure<D>& pressure)
{
  AffineScalar<D> half{particles.pore_pressure[0][row] + 0.5 * pressure.increment,
                       at<D>(particles.pressure_gradient.columns, row)};
  for (int a = 0; a < D; ++a)
    half.gradient[a] = 0.5 * (half.gradient[a] + pressure.at_end[a]);
  return sum_of_products<G>(half, {pressure.increment, pressure.of_increment}, moments) / moments.mass;
}

/// @returns work that compresses the water, by the trapezoidal rule
template <class G, int D = G::dim>
double add_increments(Particles<G::dim>& particles, double modulus, const Run& run, const Vector<G::dim>& centre,
                      const CellMoments<G>& moments, const CellPressure<G::dim>& pressure)
{
  double work = 0;
  for (Index p = run.first; p < run.last; ++p)
  {
    double increment = pressure.increment;
    for (int a = 0; a < D; ++a)
      increment += pressure.of_increment[a] * (particles.position[a][p] - centre[a]);
    const double product = run.resting ? mean_product<G>(particles, p, moments, pressure)
                                       : (particles.pore_pressure[0][p] + 0.5 * increment) * increment;
    work += particles.volume[p] * particles.porosity[0][p] / modulus * product;
    particles.pore_pressure[0][p] += increment;
    for (int a = 0; a < D; ++a)
      particles.pressure_gradient[a][p] = pressure.at_end[a];
  }
  return work;
}

/// Lets mass, and the saturation of soil that may dry, follow the water that particles take up over the step.
/// @param factor  see `integration_factor`
/// @pre pressures are those of the end, volumes and porosities of the start
/// @returns kinetic energy of the water that leaves them, which moves as they do
template <class G, int D = G::dim>
double take_up_water(const Run& run, const PoreWater& water, const ImplicitStep<G>& step, double factor, double growth,
                     const CellPressure<D>& pressure, const Vector<G::dim>& centre, const CellMoments<G>& moments,
                     Particles<D>& particles)
{
  double kinetic = 0;
  for (Index p = run.first; p < run.last; ++p)
  {
    double increment = pressure.increment;
    for (int a = 0; a < D; ++a)
      increment += pressure.of_increment[a] * (particles.position[a][p] - centre[a]);
    const double porosity = particles.porosity[0][p];
    double before = 1, after = 1;
    if (water.may_dry())
    {
      before = particles.saturation[0][p];
      after =
          wetness_at(water.retention[static_cast<std::size_t>(run.material)], particles.pore_pressure[0][p]).saturation;
      particles.saturation[0][p] = after;
    }
    const double gained = after * (growth + porosity / water.modulus * increment) + (after - before) * porosity;
    const double mass = step.pore.density * factor * particles.volume[p] * gained;
    const Vector<D> v = at<D>(particles.velocity, p);
    double squared = dot<D>(v, v);
    if (run.resting) // its mean over the particles
    {
      const Matrix<D> gradient = gradient_at<D>(particles.velocity_gradient, p);
      squared = 0;
      for (int a = 0; a < D; ++a)
        squared += sum_of_products<G>({v[a], gradient[a]}, {v[a], gradient[a]}, moments) / moments.mass;
    }
    kinetic -= 0.5 * mass * squared;
    particles.mass[p] += mass;
  }
  return kinetic;
}
} // namespace

bool changes_masses(const PoreWater& water, const ImplicitOptions& options)
{
  return water.may_dry() || !options.hold_positions;
}

template <class G>
void update_pore_water(Model<G>& model, const ImplicitStep<G>& step)
{
  if (!model.water)
    return;
  const auto& mesh = model.mesh;
  const VelocityField<G>& field = model.fields.front();
  for (const Run& run : step.runs)
  {
    if (step.pore.flows)
    {
      const auto& centre = mesh.shapes[run.cell].centre;
      const auto pressure = cell_pressure(mesh, field, step, run.cell);
      model.energy.stress_work +=
          add_increments<G>(model.particles, model.water->modulus, run, centre, field.moments[run.cell], pressure);
      const double growth = growth_of(mesh, field, step, run.cell);
      const double factor = integration_factor(mesh, field, run.cell);
      if (changes_masses(*model.water, step.options))
        model.energy.outflow_kinetic += take_up_water(run, *model.water, step, factor, growth, pressure, centre,
                                                      field.moments[run.cell], model.particles);
    }
    if (!step.options.hold_positions)
      grow_pores<G::dim>(model.particles, run.first, run.last, 1 + step.strains[run.cell].volumetric,
                         model.water->kozeny_carman);
  }
}

template <class G>
void add_flow(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
              std::span<const unsigned char> owned, PoreWater& water, Totals& totals)
{
  const auto& pore = step.pore;
  if (!pore.flows)
    return;
  const auto enter = [&](double content, Index node)
  {
    water.inflow += content;
    totals.external_work += content * end_pressure(pore, node, step.dt);
  };
  for (Index i = 0; i < static_cast<Index>(pore.content.size()); ++i)
    if (owned[i] && pore.held[i])
      enter(pore.content[i], i);
  for (Index c : step.cells)
  {
    const auto& nodes = mesh.cells[c];
    const auto& load = pore.cells[c].load; // standing water works on the surface
    totals.external_work += load.standing * volume_strain(mesh, field, step.dt, c);
    for (std::size_t k = 0; k < nodes.size(); ++k)
      totals.external_work -= step.dt * load.volume[k] * dot<G::dim>(load.gradient, field.velocity[nodes[k]]);
    const auto drive = driving_gradient(mesh, field, step, c);
    const auto weight = water_weight(mesh, field, step, c);
    totals.external_work -= flow<G::dim>(flux_of(pore, c), drive, weight);
    totals.drag_work += flow<G::dim>(flux_of(pore, c), drive, drive);
  }
  for (const auto& point : pore.surface)
  {
    const double outflow = outflow_at(point, excess_pressure(mesh, pore, point, step.dt));
    for (std::size_t k = 0; k < point.shape.size(); ++k)
      enter(-point.shape[k] * outflow, mesh.cells[point.cell][k]);
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void update_pore_water(Model<G>&, const ImplicitStep<G>&);                                                  \
  template void add_flow(const Mesh<G::dim>&, const VelocityField<G>&, const ImplicitStep<G>&,                         \
                         std::span<const unsigned char>, PoreWater&, Totals&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
