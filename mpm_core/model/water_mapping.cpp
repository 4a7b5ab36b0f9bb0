#include "model/water_mapping.h"

#include "base/lanes.h"
#include "model/anisotropy.h"
#include "model/integration.h"
#include "model/mapping.h"
#include "parallel/agreement.h"

#include <algorithm>

namespace mpm::model
{
namespace
{
/// Water in the pores of a particle, which are full unless it has a saturation.
template <int D>
double water_mass(const Particles<D>& particles, const PoreWater& water, Index p)
{
  const double density = water.density * (1 + particles.pore_pressure[0][p] / water.modulus);
  const double filled = particles.saturation.present ? particles.saturation[0][p] : 1;
  return filled * density * particles.porosity[0][p] * particles.volume[p];
}

template <int D>
void check_phases(const Particles<D>& particles, const PoreWater& water)
{
  if (!(water.modulus < std::numeric_limits<double>::infinity()))
    throw InputError("modulus of the pore water is infinite, expected a finite one in explicit runs");
  for (Index p = 0; p < particles.size(); ++p)
    if (!(water_mass(particles, water, p) < particles.mass[p]))
      throw InputError("mass of particle " + std::to_string(particles.id[p]) + " is " +
                       std::to_string(particles.mass[p]) + " kg, expected more than that of the water in its pores, " +
                       std::to_string(water_mass(particles, water, p)) + " kg; densities are of the saturated soil");
}
} // namespace

template <class G>
void fill_pores(Model<G>& model)
{
  for (Index p = 0; p < model.particles.size(); ++p)
    model.particles.water_mass[0][p] = water_mass(model.particles, *model.water, p);
}

template <class G>
void split_phases(Model<G>& model)
{
  Particles<G::dim>& particles = model.particles;
  collectively(model.exchange.comm, [&] { check_phases(particles, *model.water); });
  const auto size = static_cast<std::size_t>(particles.size());
  require(particles.water_velocity, size);
  require(particles.water_mass, size);
  particles.water_velocity.columns = particles.velocity;
  if (particles.resting.present)
  {
    require(particles.water_gradient, size);
    particles.water_gradient.columns = particles.velocity_gradient.columns;
    for (auto& gradient : particles.pressure_gradient.columns)
      std::ranges::fill(gradient, 0.0); // water spreads evenly over the pores of a cell
  }
  fill_pores(model);
  for (Index p = 0; p < particles.size(); ++p)
    particles.mass[p] -= particles.water_mass[0][p];
  particles.saturation = {}; // from now on the masses tell it
  model.ready = false;
  model.energy.stale = true;
}

namespace
{
/// Sums over the particles of a run, added to the moments of its cell.
template <class G, int D = G::dim>
void add_moments(const Particles<D>& particles, double unit_weight, const Run& run, const CellShape<D>& shape,
                 CellMoments<G>& motion, PoreMoments<D>& pores)
{
  std::array<const double*, 2 * D + 5> columns;
  for (int i = 0; i < D; ++i)
  {
    columns[i] = particles.position[i].data();
    columns[D + i] = particles.water_velocity[i].data();
  }
  constexpr int mass_at = 2 * D, volume_at = mass_at + 1, pressure_at = mass_at + 2, porosity_at = mass_at + 3,
                conductivity_at = mass_at + 4;
  columns[mass_at] = particles.water_mass[0].data();
  columns[volume_at] = particles.volume.data();
  columns[pressure_at] = particles.pore_pressure[0].data();
  columns[porosity_at] = particles.porosity[0].data();
  columns[conductivity_at] = particles.conductivity[0].data();
  struct Sums
  {
    Lanes volume, mass, drag, pressure, pores;
    std::array<Lanes, D> volume_xi, mass_xi, drag_xi, momentum, pore_velocity;
    std::array<Lanes, n_symmetric<D>> mass_xixi;
    std::array<std::array<Lanes, D>, D> momentum_xi;
  } sums{};
  const auto add = [&sums, unit_weight, centre = shape.centre](const Piece<2 * D + 5>& piece, const LaneMask& mine)
  {
    const Lanes mass = mine ? piece[mass_at] : Lanes{}, volume = mine ? piece[volume_at] : Lanes{};
    const Lanes pores = volume * piece[porosity_at];
    const Lanes drag = pores * piece[porosity_at] * unit_weight / piece[conductivity_at];
    sums.pores += pores;
    sums.mass += mass;
    sums.volume += volume;
    sums.drag += drag;
    sums.pressure += volume * piece[pressure_at];
    std::array<Lanes, D> xi, mass_xi;
    for (int i = 0; i < D; ++i)
    {
      xi[i] = piece[i] - centre[i];
      mass_xi[i] = mass * xi[i];
      sums.mass_xi[i] += mass_xi[i];
      sums.volume_xi[i] += volume * xi[i];
      sums.drag_xi[i] += drag * xi[i];
    }
    for (int k = 0; k < n_symmetric<D>; ++k)
      sums.mass_xixi[k] += mass_xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
    for (int a = 0; a < D; ++a)
    {
      sums.momentum[a] += mass * piece[D + a];
      sums.pore_velocity[a] += pores * piece[D + a];
      for (int b = 0; b < D; ++b)
        sums.momentum_xi[a][b] += mass_xi[b] * piece[D + a];
    }
  };
  add_lanes(columns, run.first, run.last, add);
  motion.volume += sum(sums.volume);
  motion.mass += sum(sums.mass);
  pores.drag += sum(sums.drag);
  pores.pores += sum(sums.pores);
  for (int k : normal_component<G>)
    motion.stress[k] -= sum(sums.pressure);
  for (int k = 0; k < n_symmetric<D>; ++k)
    motion.mass_xixi[k] += sum(sums.mass_xixi[k]);
  for (int a = 0; a < D; ++a)
  {
    motion.mass_xi[a] += sum(sums.mass_xi[a]);
    motion.momentum[a] += sum(sums.momentum[a]);
    pores.volume_xi[a] += sum(sums.volume_xi[a]);
    pores.pore_velocity[a] += sum(sums.pore_velocity[a]);
    pores.drag_xi[a] += sum(sums.drag_xi[a]);
    for (int b = 0; b < D; ++b)
      motion.momentum_xi[a][b] += sum(sums.momentum_xi[a][b]);
  }
}

/// Moments of the water in a resting cell, of whose mass and volume each particle has the same part as of the soil's.
template <class G, int D = G::dim>
void add_resting_moments(const Particles<D>& particles, double unit_weight, Index row, const CellMoments<G>& soil,
                         CellMoments<G>& motion, PoreMoments<D>& pores)
{
  const double volume = particles.volume[row], porosity = particles.porosity[0][row];
  const double part = particles.water_mass[0][row] / soil.mass;
  motion.volume = volume;
  motion.mass = particles.water_mass[0][row];
  for (int k = 0; k < n_symmetric<D>; ++k)
    motion.mass_xixi[k] = part * soil.mass_xixi[k];
  for (int k : normal_component<G>)
    motion.stress[k] = -volume * particles.pore_pressure[0][row];
  const Vector<D> velocity = at<D>(particles.water_velocity.columns, row);
  const Matrix<D> gradient = gradient_at<D>(particles.water_gradient, row);
  pores.pores = volume * porosity;
  pores.drag = pores.pores * porosity * unit_weight / particles.conductivity[0][row];
  for (int a = 0; a < D; ++a)
  {
    motion.momentum[a] = motion.mass * velocity[a];
    pores.pore_velocity[a] = pores.pores * velocity[a];
    for (int b = 0; b < D; ++b)
      for (int c = 0; c < D; ++c)
        motion.momentum_xi[a][b] += gradient[a][c] * motion.mass_xixi[symmetric_index<D>(c, b)];
  }
}

/// The water is where the soil is.
template <class G>
void follow_soil(const Mesh<G::dim>& mesh, const VelocityField<G>& soil, WaterField<G>& field)
{
  VelocityField<G>& motion = field.motion;
  const auto nodes = mesh.points.size(), cells = static_cast<std::size_t>(mesh.owned_cells);
  motion.part = soil.part;
  motion.least_mass = soil.least_mass;
  // Pressures of full cells over their volumes, whatever the soil does: sums over particles that are not spread evenly
  // give a uniform pressure forces within the soil, which only a flow of the water could balance.
  motion.integration.kind = Integration::mixed;
  motion.integration.averaged_by_law.assign(soil.integration.averaged_by_law.size(), 1.0); // pressures in full
  motion.integration.given = true; // where the soil's strains are averaged, so that both see one volume
  motion.integration.averaged_of_cell.resize(soil.integration.averaged_of_cell.size());
  for (std::size_t c = 0; c < soil.integration.averaged_of_cell.size(); ++c)
    motion.integration.averaged_of_cell[c] = soil.integration.averaged_of_cell[c] > 0 ? 1 : 0;
  motion.integration.groups = soil.integration.groups;
  motion.moments.resize(cells);
  motion.nodes.resize(nodes);
  for (auto* values : {&motion.start_velocity, &motion.acceleration, &motion.velocity_change, &motion.velocity})
    values->resize(nodes);
  field.cells.resize(cells);
  field.nodes.resize(nodes);
  field.flux.resize(nodes);
  field.supplied.resize(nodes);
}
} // namespace

template <class G>
void water_to_nodes(const Mesh<G::dim>& mesh, NodeExchange& exchange, const Particles<G::dim>& particles,
                    const std::vector<Run>& runs, const PoreWater& water, const VelocityField<G>& soil,
                    WaterField<G>& field)
{
  constexpr int D = G::dim;
  follow_soil(mesh, soil, field);
  VelocityField<G>& motion = field.motion;
  for (Index c : motion.part.cells)
  {
    motion.moments[c] = {};
    field.cells[c] = {};
  }
  field.resistance.assign(water.anisotropy.empty() ? 0 : field.cells.size(), {});
  const auto resist = [&](const Run& run, double drag)
  {
    if (!field.resistance.empty())
      add<D>(drag, resistance_of<D>(water, run.material), field.resistance[run.cell]);
  };
  for (const Run& run : runs)
  {
    PoreMoments<D>& pores = field.cells[run.cell];
    const double before = pores.drag;
    add_moments<G>(particles, laboratory_weight(water), run, mesh.shapes[run.cell], motion.moments[run.cell], pores);
    resist(run, pores.drag - before);
  }
  for (const Run& run : soil.resting.runs)
  {
    add_resting_moments<G>(particles, laboratory_weight(water), run.first, soil.moments[run.cell],
                           motion.moments[run.cell], field.cells[run.cell]);
    resist(run, field.cells[run.cell].drag);
  }
  particles_to_nodes(mesh, exchange, particles, runs, motion);
  for (Index i : motion.part.nodes)
    field.nodes[i] = {};
  field.drag.assign(field.resistance.empty() ? 0 : field.nodes.size(), {});
  for (Index c : motion.part.cells)
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D>& gradient = mesh.shapes[c].gradient[k];
      const Vector<D> dilation = dilation_gradient<G>(mesh.shapes[c], k);
      PoreNode<D>& node = field.nodes[mesh.cells[c][k]];
      node.around += motion.moments[c].volume * norm<D>(gradient);
      for (int a = 0; a < D; ++a)
        node.outward[a] += motion.moments[c].volume * dilation[a];
      node.volume += at_vertex<D>(motion.moments[c].volume, field.cells[c].volume_xi, gradient);
      const double drag = at_vertex<D>(field.cells[c].drag, field.cells[c].drag_xi, gradient);
      node.drag += drag;
      if (!field.drag.empty() && field.cells[c].drag > 0)
        add<D>(drag / field.cells[c].drag, field.resistance[c], field.drag[mesh.cells[c][k]]);
    }
}

namespace
{
/// Takes the part of a flux out that enters the soil at a free surface.
template <int D>
void keep_out(const PoreNode<D>& node, Vector<D>& flux)
{
  const double length = norm<D>(node.outward), inwards = -dot<D>(flux, node.outward);
  if (!is_at_surface<D>(node) || inwards <= 0)
    return;
  for (int a = 0; a < D; ++a)
    flux[a] += inwards / (length * length) * node.outward[a];
}
} // namespace

template <class G>
void find_flux(const Mesh<G::dim>& mesh, const VelocityField<G>& soil, const PoreWater& water, WaterField<G>& field)
{
  const bool may_run_empty = water.suction_limit < std::numeric_limits<double>::infinity();
  for (Index i : soil.part.nodes)
  {
    const bool light = is_light(soil, i) || is_light(field.motion, i);
    const double content = light ? 0 : field.motion.nodes[i].mass / field.nodes[i].volume;
    for (int a = 0; a < G::dim; ++a)
      field.flux[i][a] = content * (field.motion.velocity[i][a] - soil.velocity[i][a]);
    const bool under_water = may_run_empty && standing_pressure(water, mesh.points[i][G::dim - 1]) > 0;
    if (may_run_empty && !field.supplied[i] && !under_water)
      keep_out<G::dim>(field.nodes[i], field.flux[i]);
  }
}

template <class G>
double outflow(const Mesh<G::dim>& mesh, const WaterField<G>& field, Index cell, double dt)
{
  double divergence = 0;
  for (int k = 0; k <= G::dim; ++k)
    divergence += dot<G::dim>(field.flux[mesh.cells[cell][k]], dilation_gradient<G>(mesh.shapes[cell], k));
  return dt * divergence;
}

template <class G>
void average_outflow(const Mesh<G::dim>& mesh, NodeExchange& exchange, double dt, WaterField<G>& field)
{
  // By the volumes over which pressures are integrated, as their averages are: the transpose of these, so that water is
  // at rest where they balance its weight.
  const auto volume_of = [&](Index c) { return averaged_strain_volume(mesh, field.motion, c); };
  const auto outflow_of = [&](Index c, double volume) { return volume * outflow(mesh, field, c, dt); };
  average_over_nodes(mesh, field.motion.part, field.motion.integration.groups, volume_of, outflow_of, exchange,
                     field.motion.volumetric_strain);
}

template <class G>
double averaged_outflow(const Mesh<G::dim>& mesh, const WaterField<G>& field, Index cell, double dt)
{
  const double own = outflow(mesh, field, cell, dt);
  const double mean =
      mean_of_vertices<G::dim>(mesh, field.motion.integration.groups, cell, field.motion.volumetric_strain);
  return own + averaged_strain_fraction(field.motion.integration, cell) * (mean - own);
}

#define INSTANTIATE(G)                                                                                                 \
  template void fill_pores(Model<G>&);                                                                                 \
  template void split_phases(Model<G>&);                                                                               \
  template void water_to_nodes(const Mesh<G::dim>&, NodeExchange&, const Particles<G::dim>&, const std::vector<Run>&,  \
                               const PoreWater&, const VelocityField<G>&, WaterField<G>&);                             \
  template void find_flux(const Mesh<G::dim>&, const VelocityField<G>&, const PoreWater&, WaterField<G>&);             \
  template double averaged_outflow(const Mesh<G::dim>&, const WaterField<G>&, Index, double);                          \
  template double outflow(const Mesh<G::dim>&, const WaterField<G>&, Index, double);                                   \
  template void average_outflow(const Mesh<G::dim>&, NodeExchange&, double, WaterField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
