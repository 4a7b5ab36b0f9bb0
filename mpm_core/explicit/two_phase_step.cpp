#include "explicit/two_phase_step.h"

#include "explicit/dashpots.h"
#include "explicit/momentum.h"
#include "explicit/particle_update.h"
#include "explicit/phase_momentum.h"
#include "model/absorbing.h"
#include "model/mapping.h"
#include "model/pore_forces.h"
#include "model/pressure_relaxation.h"
#include "model/resting_nodes.h"
#include "model/water_mapping.h"
#include "model/water_pass.h"
#include "model/wet_contacts.h"

#include <cmath>

namespace mpm::explicit_scheme
{
template <class G>
void two_phase_step(Model<G>& model, const ExplicitOptions& options, double dt)
{
  PhaseClock clock(model.phase_seconds);
  const auto gravity = gravity_at(model, model.time);
  const double density = model.water->density;
  const auto& mesh = model.mesh;
  NodeExchange& exchange = model.exchange;
  VelocityField<G>& soil = model.fields.front();
  WaterField<G>& water = model.water_field;

  // Particles to nodes: masses (11), momenta, forces of effective stresses (14) and tractions (15); of pore pressures
  clock.begin(Phase::node_sums);
  stand_water(model, model.time, gravity);
  map_to_nodes(model);
  find_start_velocity(soil);
  find_start_velocity(water.motion);
  follow_supports<G>(soil, water.motion, water.motion.start_velocity);
  add_wet_contact_forces(model, dt);
  close_sides<G>(soil, water, soil.start_velocity, water.motion.start_velocity);
  add_rayleigh_forces(model, options.rayleigh, soil);
  add_forces_of_ground(mesh, gravity, model.time, dt, soil, &water.motion);
  // Momentum balance of both phases, coupled by the drag at the step's end
  clock.begin(Phase::momentum);
  find_phase_accelerations(gravity, options.damping, dt, density, soil, water);
  // Second mapping (19)
  clock.begin(Phase::mapping);
  if (options.has_dashpots)
  {
    for (VelocityField<G>* phase : {&soil, &water.motion})
      find_velocity_change(*phase, options.pic_fraction, dt);
    if (options.renews_dashpots)
      prepare_dashpots(model);
    add_dashpots(model, options.pic_fraction, dt, soil, &water.motion);
  }
  for (VelocityField<G>* phase : {&soil, &water.motion})
  {
    find_velocity_change(*phase, options.pic_fraction, dt);
    scatter_momentum<G>(mesh, model.exchange, part_of_particles(*phase), phase->moments, phase->velocity_change,
                        phase->velocity);
    gain_resting_momentum<G>(model, options.pic_fraction, *phase,
                             phase->velocity); // of the soil: the mass of water changes, whose moments follow
    sum_shared(exchange, phase->velocity);
    find_mapped_velocity(1 - options.pic_fraction, *phase);
    keep_driven_velocity<G>(soil.dashpots, dt, *phase);
  }
  follow_supports<G>(soil, water.motion, water.motion.velocity);
  close_sides<G>(soil, water, soil.velocity, water.motion.velocity);
  clock.begin(Phase::momentum);
  add_phase_work(soil, water, exchange.owned, gravity, options.damping, dt, density, model.totals);
  for (const VelocityField<G>* phase : {&soil, &water.motion})
    note_rayleigh_work(exchange.owned, dt, *phase, model.totals);
  // Flow of the water through the soil, and volumetric strains
  clock.begin(Phase::averaging);
  find_flux(mesh, soil, *model.water, water);
  if (options.nmd)
  {
    average_strains(mesh, exchange, soil.velocity, dt, soil);
    relax_pressures(model, dt, soil);
    average_outflow(mesh, exchange, dt, water);
  }
  // Nodes to particles: the water's velocity, mass and pressure; then (18), (20), effective stresses; migration
  clock.begin(Phase::particles);
  const auto [work_before, work_after] = water_pass(model, dt, 1 - options.pic_fraction, options.nmd);
  update_particles(model, options, dt, true, clock);
  model.energy.ahead += work_after;
  model.energy.stress_work += work_before + work_after;
}

double fast_wave_squared(double modulus, double water_modulus, double porosity, double soil, double water)
{
  const double grains = 1 - porosity;
  const double k_ss = modulus + grains * grains * water_modulus / porosity, k_ww = porosity * water_modulus;
  const double trace = k_ss / soil + k_ww / water, determinant = modulus * k_ww / (soil * water);
  return 0.5 * trace + std::sqrt(0.25 * trace * trace - determinant);
}

#define INSTANTIATE(G) template void two_phase_step(Model<G>&, const ExplicitOptions&, double);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
