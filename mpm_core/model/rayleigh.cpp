#include "model/rayleigh.h"

#include "model/mapping.h"
#include "model/material_points.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace mpm::model
{
double damped_time_step(const Rayleigh& rayleigh, double critical, double critical_of_soil)
{
  const double of_damping = critical / critical_of_soil;
  const double ratio = rayleigh.stiffness / critical * of_damping * of_damping + 0.25 * rayleigh.mass * critical;
  return critical * (std::sqrt(1 + ratio * ratio) - ratio);
}

namespace
{
/// beta times the rate of elastic stress of a cell, by the velocities at the start.
template <class G, int D = G::dim>
Working<G> viscous_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell, const WaveModuli& moduli,
                          double beta)
{
  const auto start = [&](Index i) -> const Vector<D>& { return field.start_velocity[i]; };
  const AffineField<D> velocity = affine_field<D>(mesh, cell, start);
  const double mu = beta * moduli.shear, lambda = beta * moduli.p_wave - 2 * mu;
  double hoop = 0, trace = 0;
  if constexpr (G::has_hoop)
    hoop = velocity.value[0] / mesh.shapes[cell].centre[0];
  for (int i = 0; i < D; ++i)
    trace += velocity.gradient[i][i];
  trace += hoop;
  const double averaged = has_averaged_forces(field.integration) ? averaged_strain(mesh, field, cell, trace) : trace;
  const double mean = lambda * averaged + 2 * mu * (averaged - trace) / G::n_normal;
  Working<G> stress;
  for (int s = 0; s < n_symmetric<D>; ++s)
  {
    const auto [i, j] = symmetric_pairs<D>[s];
    stress[s] = mu * (velocity.gradient[i][j] + velocity.gradient[j][i]) + (i == j ? mean : 0);
  }
  if constexpr (G::has_hoop)
    stress[n_symmetric<D>] = mean + 2 * mu * hoop;
  return stress;
}

/// Adds forces against the velocity of the soil, in proportion to mass, to the nodes of a cell.
/// @param mass  of what some points have in the cell
/// @param moving  field of this mass, of soil or water
template <class G, int D = G::dim>
void add_mass_forces(const Mesh<D>& mesh, Index cell, double rate, double mass,
                     std::span<const Vector<G::dim>> velocity, VelocityField<G>& moving)
{
  const CellMoments<G>& moments = moving.moments[cell];
  if (mass == 0)
    return;
  for (int k = 0; k <= D; ++k)
  {
    const Index node = mesh.cells[cell][k];
    const double of_node =
        mass / moments.mass * at_vertex<D>(moments.mass, moments.mass_xi, mesh.shapes[cell].gradient[k]);
    for (int a = 0; a < D; ++a)
      moving.damping_force[node][a] -= rate * of_node * velocity[node][a];
  }
}

/// Adds what the points of one law in a cell give: stress times volume to the cell, and forces in proportion to mass to
/// its nodes.
/// @param water  of these points, if it has a velocity of its own; else null
template <class G, int D = G::dim>
void add_run(const Mesh<D>& mesh, const MaterialPoints<D>& points, const Run& run, const Rayleigh& rayleigh,
             std::vector<Working<G>>& stress, VelocityField<G>& field, VelocityField<G>* water)
{
  double mass = 0, volume = 0, of_water = 0;
  for (Index p = run.first; p < run.last; ++p)
  {
    if (!points.particles.state.empty() && points.particles.state[0][p] > rayleigh.plastic_strain)
      return;
    mass += points.particles.mass[p];
    volume += points.particles.volume[p];
    of_water += water ? points.particles.water_mass[0][p] : 0;
  }
  // a vertex without mass stands still, which would strain the cell
  const bool is_strained =
      rayleigh.stiffness > 0 && std::ranges::none_of(mesh.cells[run.cell], [&](Index i) { return is_light(field, i); });
  if (is_strained)
  {
    const Working<G> own =
        viscous_stress<G>(mesh, field, run.cell, mean_moduli(points, run), rayleigh.stiffness * volume);
    for (std::size_t s = 0; s < own.size(); ++s)
      stress[run.cell][s] += own[s];
  }
  add_mass_forces<G>(mesh, run.cell, rayleigh.mass, mass, field.start_velocity, field);
  if (water)
    add_mass_forces<G>(mesh, run.cell, rayleigh.mass, of_water, field.start_velocity, *water);
}

/// Adds the forces of the cells' stresses to their nodes.
/// @note Collective with nodal mixed discretisation
template <class G, int D = G::dim>
void add_stress_forces(Model<G>& model, std::vector<Working<G>>& stress, VelocityField<G>& field)
{
  if (has_averaged_forces(field.integration))
    average_stresses<G>(model.mesh, model.exchange, field, stress);
  for (Index c : field.part.cells)
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> viscous = internal_force<G>(stress[c], model.mesh.shapes[c], k);
      for (int a = 0; a < D; ++a)
        field.damping_force[model.mesh.cells[c][k]][a] -= viscous[a];
    }
}

/// Adds the forces on a phase, over all ranks, to the tractions of the soil, which act on soil and water.
/// @param phase  the soil, or its water
/// @note Collective
template <class G, int D = G::dim>
void add_to_tractions(NodeExchange& exchange, VelocityField<G>& phase, VelocityField<G>& soil)
{
  sum_shared(exchange, phase.damping_force);
  for (Index i : soil.part.nodes)
  {
    if (&phase != &soil && is_light(phase, i))
      phase.damping_force[i] = {};
    for (int a = 0; a < D; ++a)
      soil.nodes[i].traction[a] += phase.damping_force[i][a];
  }
}
} // namespace

template <class G>
void add_rayleigh_forces(Model<G>& model, const Rayleigh& rayleigh, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  field.damping_force.clear();
  model.water_field.motion.damping_force.clear();
  if (rayleigh.mass == 0 && rayleigh.stiffness == 0)
    return;
  VelocityField<G>* const water = rayleigh.mass > 0 && has_two_phases(model) ? &model.water_field.motion : nullptr;
  field.damping_force.assign(field.nodes.size(), {});
  if (water)
    water->damping_force.assign(field.nodes.size(), {});
  if (rayleigh.stiffness > 0 && has_averaged_forces(field.integration))
    average_strains(model.mesh, model.exchange, field.start_velocity, 1.0, field); // rates
  std::vector<Working<G>> stress(rayleigh.stiffness > 0 ? static_cast<std::size_t>(model.mesh.owned_cells) : 0);
  for (const MaterialPoints<D>& points : {material_points(model), resting_points(model)})
    for (const Run& run : points.runs)
      if (&field_of(model, run.material) == &field)
        add_run<G>(model.mesh, points, run, rayleigh, stress, field, water);
  if (rayleigh.stiffness > 0)
    add_stress_forces(model, stress, field);
  add_to_tractions<G>(model.exchange, field, field);
  if (water)
    add_to_tractions<G>(model.exchange, *water, field);
}

template <class G>
void note_rayleigh_work(std::span<const unsigned char> owned, double dt, const VelocityField<G>& field, Totals& totals)
{
  double work = 0;
  if (field.damping_force.empty())
    return;
  for (Index i : field.part.nodes)
    if (owned[i] && !is_light(field, i))
      for (int a = 0; a < G::dim; ++a)
        work += field.damping_force[i][a] * 0.5 * dt * (field.start_velocity[i][a] + field.velocity[i][a]);
  totals.external_work -= work;
  totals.damping_work -= work;
}

#define INSTANTIATE(G)                                                                                                 \
  template void add_rayleigh_forces(Model<G>&, const Rayleigh&, VelocityField<G>&);                                    \
  template void note_rayleigh_work(std::span<const unsigned char>, double, const VelocityField<G>&, Totals&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
