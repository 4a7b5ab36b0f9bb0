#include "model/rayleigh.h"

#include "model/mapping.h"
#include "model/material_points.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>

namespace mpm::model
{
double damped_time_step(const Rayleigh& rayleigh, double critical)
{
  const double ratio = rayleigh.stiffness / critical + 0.25 * rayleigh.mass * critical;
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

/// Adds what the points of one law in a cell give: stress times volume to the cell, and forces in proportion to mass to
/// its nodes.
template <class G, int D = G::dim>
void add_run(const Mesh<D>& mesh, const MaterialPoints<D>& points, const Run& run, const Rayleigh& rayleigh,
             std::vector<Working<G>>& stress, VelocityField<G>& field)
{
  double mass = 0, volume = 0;
  for (Index p = run.first; p < run.last; ++p)
  {
    if (!points.particles.state.empty() && points.particles.state[0][p] > rayleigh.plastic_strain)
      return;
    mass += points.particles.mass[p];
    volume += points.particles.volume[p];
  }
  const CellShape<D>& shape = mesh.shapes[run.cell];
  const CellMoments<G>& moments = field.moments[run.cell];
  const auto& nodes = mesh.cells[run.cell];
  // a vertex without mass stands still, which would strain the cell
  const bool is_strained =
      rayleigh.stiffness > 0 && std::ranges::none_of(nodes, [&](Index i) { return is_light(field, i); });
  if (is_strained)
  {
    const Working<G> own =
        viscous_stress<G>(mesh, field, run.cell, mean_moduli(points, run), rayleigh.stiffness * volume);
    for (std::size_t s = 0; s < own.size(); ++s)
      stress[run.cell][s] += own[s];
  }
  for (int k = 0; k <= D; ++k)
  {
    const Vector<D>& velocity = field.start_velocity[nodes[k]];
    const double of_node = mass / moments.mass * at_vertex<D>(moments.mass, moments.mass_xi, shape.gradient[k]);
    for (int a = 0; a < D; ++a)
      field.damping_force[nodes[k]][a] -= rayleigh.mass * of_node * velocity[a];
  }
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
} // namespace

template <class G>
void add_rayleigh_forces(Model<G>& model, const Rayleigh& rayleigh, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  field.damping_force.clear();
  if (rayleigh.mass == 0 && rayleigh.stiffness == 0)
    return;
  field.damping_force.assign(field.nodes.size(), {});
  if (rayleigh.stiffness > 0 && has_averaged_forces(field.integration))
    average_strains(model.mesh, model.exchange, field.start_velocity, 1.0, field); // rates
  std::vector<Working<G>> stress(rayleigh.stiffness > 0 ? static_cast<std::size_t>(model.mesh.owned_cells) : 0);
  for (const MaterialPoints<D>& points : {material_points(model), resting_points(model)})
    for (const Run& run : points.runs)
      if (&field_of(model, run.material) == &field)
        add_run<G>(model.mesh, points, run, rayleigh, stress, field);
  if (rayleigh.stiffness > 0)
    add_stress_forces(model, stress, field);
  sum_shared(model.exchange, field.damping_force);
  for (Index i : field.part.nodes)
    for (int a = 0; a < D; ++a)
      field.nodes[i].traction[a] += field.damping_force[i][a];
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
