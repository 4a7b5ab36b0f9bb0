#include "model/pressure_relaxation.h"

#include "base/eigen.h"
#include "model/integration.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace mpm::model
{
namespace
{
/// Volume around a node, and integrals over it; plain doubles.
template <int D>
struct PressureNode
{
  double volume, pressure;
  Vector<D> place;
};

/// Undrained modulus of a soil, of the compression wave [Pa]; 0 where its water may flow without moving particles.
template <class G>
double undrained_modulus(const Model<G>& model, Index material, Index cell)
{
  const Law& law = model.laws[static_cast<std::size_t>(material)];
  if (has_two_phases(model))
    return p_wave_modulus(law) +
           model.water->modulus * model.water_field.motion.moments[cell].volume / model.water_field.cells[cell].pores;
  return std::holds_alternative<materials::Undrained>(law) ? p_wave_modulus(law) : 0;
}

/// Mean total pressure of the particles of a cell [Pa].
template <class G>
double mean_pressure(const Model<G>& model, const VelocityField<G>& field, Index cell)
{
  double sum = 0;
  for (int k : normal_component<G>)
  {
    sum -= field.moments[cell].stress[k];
    if (has_two_phases(model))
      sum -= model.water_field.motion.moments[cell].stress[k];
  }
  return sum / (G::n_normal * field.moments[cell].volume);
}

/// The cells that take part: those of undrained soil alone whose strains are averaged.
template <class G, int D = G::dim>
void find_relaxing_cells(const Model<G>& model, VelocityField<G>& field)
{
  auto& cells = field.integration.relaxing;
  cells.assign(field.moments.size(), {});
  for (const std::span<const Run> runs : {std::span(model.order.runs), std::span(std::as_const(field.resting.runs))})
    for (const Run& run : runs)
    {
      if (&field_of(model, run.material) != &field || averaged_strain_fraction(field.integration, run.cell) == 0)
        continue;
      RelaxingCell<D>& cell = cells[run.cell];
      const double modulus = undrained_modulus(model, run.material, run.cell);
      const double compliance = modulus > 0 ? 1 / modulus : -1; // least of the soils in the cell
      cell.compliance = cell.compliance == 0 ? compliance : std::min(cell.compliance, compliance);
      cell.pressure = mean_pressure(model, field, run.cell);
      const CellMoments<G>& moments = field.moments[run.cell];
      cell.centre = model.mesh.shapes[run.cell].centre;
      for (int a = 0; a < D; ++a)
        cell.centre[a] += moments.mass_xi[a] / moments.mass;
    }
}

/// Weights of a place in the simplex of the nodes' mean places, for values that are linear between them.
/// @returns whether the simplex has a volume, and the place is not far out of it
template <int D>
bool find_weights(const std::array<Vector<D>, D + 1>& corners, const Vector<D>& place, double volume,
                  std::array<double, D + 1>& weights)
{
  Matrix<D> edges;
  Vector<D> from;
  for (int a = 0; a < D; ++a)
  {
    from[a] = place[a] - corners[0][a];
    for (int k = 0; k < D; ++k)
      edges[k][a] = corners[static_cast<std::size_t>(k) + 1][a] - corners[0][a];
  }
  constexpr double least_volume = 0.05, farthest = 1.5;
  const double factorial = D == 2 ? 2 : 6;
  if (!(std::abs(as_eigen<D>(edges).determinant()) > least_volume * factorial * volume))
    return false;
  const Matrix<D> inverse = base::inverse<D>(edges);
  weights[0] = 1;
  for (std::size_t k = 0; k < D; ++k)
  {
    weights[k + 1] = 0;
    for (std::size_t a = 0; a < D; ++a)
      weights[k + 1] += from[a] * inverse[a][k];
    weights[0] -= weights[k + 1];
  }
  return std::ranges::all_of(weights, [](double weight) { return std::abs(weight) < farthest; });
}

/// Rate of shear strain of a cell, sqrt(2 e : e) of the deviator of its rate of deformation.
template <class G, int D = G::dim>
double shear_rate(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  const auto velocity = [&](Index i) -> const Vector<D>& { return field.velocity[i]; };
  const AffineField<D> velocity_field = affine_field<D>(mesh, cell, velocity);
  const Matrix<D>& gradient = velocity_field.gradient;
  double trace = 0, square = 0;
  for (int a = 0; a < D; ++a)
  {
    trace += gradient[a][a];
    for (int b = 0; b < D; ++b)
      square += 0.5 * gradient[a][b] * (gradient[a][b] + gradient[b][a]);
  }
  if constexpr (G::has_hoop)
  {
    const double hoop = velocity_field.value[0] / mesh.shapes[cell].centre[0];
    trace += hoop;
    square += hoop * hoop;
  }
  return std::sqrt(std::max(0.0, 2 * (square - trace * trace / 3)));
}

/// Volumes, and integrals over them, around the nodes.
/// @note Collective
template <class G, int D = G::dim>
void sum_pressures(Model<G>& model, const VelocityField<G>& field, std::vector<PressureNode<D>>& nodes)
{
  const auto add_cell = [&](Index c, auto&& add)
  {
    const RelaxingCell<D>& cell = field.integration.relaxing[c];
    if (!(cell.compliance > 0))
      return;
    const double volume = field.moments[c].volume;
    PressureNode<D> term{volume, volume * cell.pressure, cell.centre};
    for (double& coordinate : term.place)
      coordinate *= volume;
    for (int k = 0; k <= D; ++k)
      add(k, term);
  };
  sum_at_means<PressureNode<D>>(model.mesh, field.part, field.integration.groups, model.exchange, std::span(nodes),
                                add_cell);
}

/// M^-1 L P of the cells by the fraction that fades over a time [s]; none where the means of the nodes do not say what
/// is linear.
template <class G, int D = G::dim>
void find_differences(const Mesh<D>& mesh, const std::vector<PressureNode<D>>& nodes, double time,
                      VelocityField<G>& field)
{
  for (Index c : field.part.cells)
  {
    RelaxingCell<D>& cell = field.integration.relaxing[c];
    if (!(cell.compliance > 0))
      continue;
    std::array<Vector<D>, D + 1> corners;
    double difference = cell.pressure;
    const auto means = means_of(mesh, field.integration.groups, c);
    for (std::size_t k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        corners[k][a] = nodes[means[k]].place[a] / nodes[means[k]].volume;
    if (!find_weights<D>(corners, cell.centre, mesh.shapes[c].volume, cell.weights))
      continue;
    for (std::size_t k = 0; k <= D; ++k)
      difference -= cell.weights[k] * nodes[means[k]].pressure / nodes[means[k]].volume;
    const double fraction = -std::expm1(-relaxed_per_shear_strain * time * shear_rate<G>(mesh, field, c));
    cell.strain = std::min(fraction, most_relaxed) * cell.compliance * difference;
  }
}

/// Takes B^T of the cells' values off them.
/// @note Collective
template <class G, int D = G::dim>
void subtract_transpose(Model<G>& model, const std::vector<PressureNode<D>>& nodes, VelocityField<G>& field)
{
  auto& cells = field.integration.relaxing;
  std::vector<double> given(nodes.size());
  const AveragedGroups& groups = field.integration.groups;
  const auto add_cell = [&](Index c, auto&& add)
  {
    for (int k = 0; cells[c].compliance > 0 && k <= D; ++k)
      add(k, field.moments[c].volume * cells[c].weights[static_cast<std::size_t>(k)] * cells[c].strain);
  };
  sum_at_means<double>(model.mesh, field.part, groups, model.exchange, std::span(given), add_cell);
  for (Index c : field.part.cells)
    if (cells[c].compliance > 0)
    {
      const auto means = means_of(model.mesh, groups, c);
      for (std::size_t k = 0; k <= D; ++k)
        cells[c].strain -= given[means[k]] / nodes[means[k]].volume;
    }
}
} // namespace

template <class G>
void relax_pressures(Model<G>& model, double dt, VelocityField<G>& field)
{
  const bool is_undrained =
      std::ranges::any_of(model.laws, [](const Law& law) { return std::holds_alternative<materials::Undrained>(law); });
  if (model.totals.steps % relaxation_interval != 0 || !(is_undrained || has_two_phases(model)))
    return;
  find_relaxing_cells(model, field);
  const auto groups = static_cast<std::size_t>(field.integration.groups.count);
  std::vector<PressureNode<G::dim>> nodes(groups * model.mesh.points.size());
  sum_pressures(model, field, nodes);
  find_differences(model.mesh, nodes, relaxation_interval * dt, field);
  subtract_transpose(model, nodes, field);
  for (Index c : field.part.cells)
  {
    const RelaxingCell<G::dim>& cell = field.integration.relaxing[c];
    if (!(cell.compliance > 0))
      continue;
    // not work that the motion does, but what the soil loses: the mean of before and after
    const double volume = field.moments[c].volume;
    model.energy.stress_work += volume * cell.strain * (cell.pressure - 0.5 * cell.strain / cell.compliance);
  }
}

#define INSTANTIATE(G) template void relax_pressures(Model<G>&, double, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
