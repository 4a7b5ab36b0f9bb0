#include "explicit/run.h"

#include "explicit/critical_step.h"
#include "materials/laws/substeps.h"
#include "model/contacts.h"
#include "model/members.h"
#include "model/moving_cells.h"
#include "model/moving_limits.h"
#include "model/resting_nodes.h"
#include "parallel/agreement.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace mpm::explicit_scheme
{
namespace
{
/// Six digits, or nine of coordinates of a map, whose metres count.
template <std::size_t N>
std::string show(const std::array<double, N>& values)
{
  const bool far = std::ranges::any_of(values, [](double value) { return std::abs(value) >= 1e4; });
  std::ostringstream out;
  out.precision(far ? 9 : 6);
  for (std::size_t i = 0; i < N; ++i)
    out << (i ? ", " : "(") << values[i];
  return out.str() + ")";
}

} // namespace

template <class G, int D>
std::string failure_text(const Model<G>& model, const Failure<D>& failure)
{
  std::ostringstream out;
  out.precision(9);
  out << "particle " << failure.particle << " at " << show(failure.position) << " m with velocity "
      << show(failure.velocity) << " m/s ";
  switch (failure.kind)
  {
  case Failure<D>::Kind::left_mesh:
    out << "left the background mesh; where the soil is to stay, support it there (model.fix, model.roller), else "
           "extend the mesh or name the facets as outflow";
    break;
  case Failure<D>::Kind::not_finite:
    out << "has a position that is not a number; the step may be too large for the stiffness";
    break;
  case Failure<D>::Kind::law_failed:
  case Failure<D>::Kind::law_failed_in_parts:
    out << "follows the law " << law_name(model.laws[static_cast<std::size_t>(failure.material)]) << " (number "
        << failure.material << "), which failed for the strain increment " << show(failure.strain_increment);
    if (failure.kind == Failure<D>::Kind::law_failed_in_parts)
      out << ", also when it was cut into " << most_parts << " parts";
    break;
  case Failure<D>::Kind::closed_pores:
    out << "has no pores left, by a volume that is smaller than that of its grains";
    break;
  case Failure<D>::Kind::lost_volume:
    out << "is in a cell that would lose its volume by the strain increment " << show(failure.strain_increment);
    break;
  }
  out << " (in the step after t = " << model.time << " s)";
  return out.str();
}

namespace
{
/// What else to say where a run has failed.
std::string advice_on(const ExplicitOptions& options)
{
  if (options.stress_update != StressUpdate::last)
    return "";
  return "; with stress_update LAST particles near nodes of little mass are thrown out, expected MODIFIED_LAST";
}

/// @throws InputError integration that the geometry, several velocity fields or resting cells do not have
template <class G>
void require_integration(const Model<G>& model, const ExplicitOptions& options)
{
  if (options.integration == Integration::dual_domain && model.particles.resting.present)
    throw InputError("integration is DUAL_DOMAIN, expected PARTICLES or MIXED with resting cells");
  if (options.integration == Integration::dual_domain && (G::has_hoop || model.fields.size() > 1))
    throw InputError("integration is DUAL_DOMAIN, expected PARTICLES or MIXED in axial symmetry and with several "
                     "velocity fields");
}

/// Whether there are absorbing or driven sides.
/// @throws InputError with strains by the velocity of the start, which has dashpots of the step before
/// @note Collective
template <class G>
bool has_dashpots(const Model<G>& model, StressUpdate stress_update)
{
  int any = model.fields.front().dashpots.empty() ? 0 : 1;
  MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, model.exchange.comm);
  if (any && stress_update == StressUpdate::first)
    throw InputError("stress_update is FIRST with absorbing or driven sides, whose dashpots would generate energy; "
                     "expected MODIFIED_LAST or LAST");
  return any;
}

/// @param option  that runs with more than particles and boundary conditions do not have, as `name is value`
/// @throws InputError what the run has beside these
template <class G>
void require_plain(const Model<G>& model, const ExplicitOptions& options, const std::string& option)
{
  const auto refuse = [&option](bool asked, const std::string& what)
  {
    if (asked)
      throw InputError(option + " with " + what + ", expected a run without");
  };
  refuse(options.integration == Integration::dual_domain, "integration DUAL_DOMAIN");
  refuse(options.stress_update == StressUpdate::first, "stress_update FIRST");
  refuse(options.stress_update == StressUpdate::last, "stress_update LAST");
  refuse(options.rayleigh.mass > 0 || options.rayleigh.stiffness > 0, "rayleigh damping");
  refuse(model.particles.resting.present, "resting cells");
  refuse(!model.contacts.empty() || !model.field_contacts.empty(), "contact");
  refuse(model.water.has_value(), "pore water");
  refuse(!model.members.empty(), "structural members");
  for (const VelocityField<G>& field : model.fields)
    refuse(!field.dashpots.empty() || !field.free_fields.empty(), "absorbing sides");
}

/// @throws InputError what affine transfer does not cover
template <class G>
void require_affine(const Model<G>& model, const ExplicitOptions& options)
{
  require_plain(model, options, "transfer is AFFINE");
  if (options.reproducible || model.fields.size() > 1)
    throw InputError("transfer is AFFINE, expected FLIP in reproducible runs and with several velocity fields");
}

/// @throws InputError what moving cells do not cover
template <class G>
void require_moving_cells(const Model<G>& model, const ExplicitOptions& options)
{
  const std::string option = "moving_cells is True";
  require_plain(model, options, option);
  if (options.reproducible || model.fields.size() > 1)
    throw InputError(option + ", expected False in reproducible runs and with several velocity fields");
  if (options.transfer == Transfer::affine)
    throw InputError(option + " with transfer AFFINE, expected FLIP");
  if (!model.outflow_tags.empty())
    throw InputError(option + " with outflow facets, expected a mesh without, since no particle reaches them");
}

/// Books what an affine transfer has lost in a run: the work that moved the nodes less the gain of kinetic energy.
/// @note Collective
template <class G>
void end_transfer(Model<G>& model)
{
  EnergyBook& book = model.energy;
  book.pic_loss += book.kinetic; // at the start, without that of particles that flowed out
  book.kinetic = affine_kinetic_energy(model);
  book.pic_loss -= book.kinetic;
}

/// @throws InputError what structural members do not cover
template <class G>
void require_members(const Model<G>& model)
{
  if (model.members.empty())
    return;
  if (G::has_hoop || model.fields.size() > 1 || has_two_phases(model))
    throw InputError(
        "the model has structural members, expected none in axial symmetry, with several velocity fields or "
        "with water that has a velocity of its own");
}

template <class G>
double next_step(const Model<G>& model, const RunOptions& run, double critical)
{
  if (run.dt && *run.dt > critical * (1 + 1e-12) && !run.allow_unstable)
  {
    std::ostringstream out;
    out.precision(6);
    out << "dt is " << *run.dt << " s, above the critical time step " << critical << " s at t = " << model.time
        << " s; take a smaller one or say allow_unstable";
    throw InputError(out.str());
  }
  const double longest = run.dt.value_or(run.courant * critical);
  const double left = run.until - model.time;
  return left / std::max(1.0, std::ceil(left / longest - 1e-6));
}
} // namespace

template <class G>
std::int64_t run_explicit(Model<G>& model, const ExplicitOptions& options, const RunOptions& run)
{
  require_integration(model, options);
  require_members(model);
  ExplicitOptions of_step = options;
  of_step.has_dashpots = has_dashpots(model, options.stress_update);
  if (options.reproducible)
    require_plain(model, options, "reproducible is True");
  if (options.transfer == Transfer::affine)
    require_affine(model, options);
  if (options.moving_cells)
    require_moving_cells(model, options);
  else
    reset_cells(model);
  begin_transfer(model, options.transfer);
  prepare(model);
  begin_members(model);
  if (options.moving_cells)
    begin_moving_cells(model);
  std::int64_t done = 0;
  double dt = 0;
  const double closeness = 1e-9 * std::abs(run.until);
  while (run.until - model.time > closeness && (run.max_steps == 0 || done < run.max_steps))
  {
    if (done % control_interval == 0)
    {
      note_largest_work(model);
      if (run.conversion)
        convert_failing(model, *run.conversion);
      const double of_members = squared_frequency_of_members(model);
      const double of_cells = critical_time_step(model), critical = critical_with_members(of_cells, of_members);
      const double of_soil = options.rayleigh.stiffness > 0
                                 ? critical_with_members(critical_time_step_of_soil(model), of_members)
                                 : critical;
      dt = next_step(model, run, damped_time_step(options.rayleigh, critical, of_soil));
      convert_near_surfaces(model, control_interval * dt);
      of_step.pic_fraction = pic_fraction_of_step(run.pic, dt, of_cells); // stiff members must not brake the soil
    }
    of_step.renews_dashpots = done % control_interval == 0;
    explicit_step(model, of_step, dt);
    if (model.failure)
      break;
    ++done;
    if (!options.moving_cells)
      continue;
    if (const std::string text = end_of_moving_cells(model); !text.empty())
      throw RunError(text);
  }
  update_resting_rows(model);
  if (options.transfer == Transfer::affine)
    end_transfer(model);
  if (model.failure)
    throw RunError(failure_text(model, *model.failure) + advice_on(options));
  make_resting_cells(model.mesh, model.particles, model.fields.front()); // as a run that goes on from a file begins
  if (run.until - model.time <= closeness)
    model.time = run.until;
  return done;
}

namespace
{
/// Each particle must be in exactly one cell's sums, and none may have been lost or doubled between ranks.
/// @throws RunError on all ranks
template <class G, int D = G::dim>
void check_conservation(const Model<G>& model, const Diagnostics& local)
{
  const Inventory now = taken_inventory(model);
  std::ostringstream out;
  out.precision(17);
  if (now.particles != model.inventory.particles || std::abs(now.mass - model.inventory.mass) > 1e-9 * now.mass)
    out << "the ranks hold " << now.particles << " particles of " << now.mass << " kg, those that flowed out included; "
        << "there were " << model.inventory.particles << " of " << model.inventory.mass << " kg";
  std::array<double, 4> cells{};
  double scale = 0;
  for (const VelocityField<G>& field : model.fields)
    for (const CellMoments<G>& moments : field.moments)
    {
      cells[0] += moments.mass;
      for (int i = 0; i < D; ++i)
        cells[static_cast<std::size_t>(i) + 1] += moments.momentum[i];
    }
  for (Index p = 0; p < model.particles.size(); ++p)
    scale += model.particles.mass[p] * norm<D>(at<D>(model.particles.velocity, p));
  for (const VelocityField<G>& field : model.fields) // a body at rest has the round-off of the forces in its momenta
    for (Index i : field.part.nodes)
      scale += model.last.dt * norm<D>(field.nodes[i].internal);
  const std::array<double, 4> particles{local.mass, local.momentum[0], local.momentum[1], local.momentum[2]};
  for (std::size_t k = 0; k < 4; ++k)
    if (std::abs(cells[k] - particles[k]) > 1e-9 * (k == 0 ? local.mass : scale))
      out << "the cells of rank " << model.exchange.rank << " hold " << cells[k] << (k == 0 ? " kg" : " N s")
          << ", its particles " << particles[k];
  if (const std::string text = shared_failure(model.exchange.comm, out.str()); !text.empty())
    throw RunError("particles were lost or counted twice: " + text);
}

/// What is taken at particles and nodes, of this rank.
template <class G, int D = G::dim>
void take_energies(const Model<G>& model, Diagnostics& d)
{
  const EnergyBook& book = model.energy;
  const ParticleEnergy energy = particle_energy(model);
  d.kinetic_energy = energy.kinetic;
  d.stored_energy = energy.stored;
  d.stress_work = book.stress_work;
  d.plastic_work = book.stress_work - energy.stored - book.outflow_stored - book.plastic_start;
  d.pic_loss = book.pic_loss;
  d.unexplained_energy = energy_balance(model, energy.kinetic) - book.balance_start;
  for (const VelocityField<G>& field : model.fields)
    for (Index i : field.part.nodes)
      if (model.exchange.owned[i])
        d.nodal_kinetic_energy += 0.5 * field.nodes[i].mass * dot<D>(field.velocity[i], field.velocity[i]);
  const VelocityField<G>& water = model.water_field.motion;
  for (Index i : water.part.nodes)
    if (model.exchange.owned[i])
      d.nodal_kinetic_energy += 0.5 * water.nodes[i].mass * dot<D>(water.velocity[i], water.velocity[i]);
}

/// The works and energies since the balance began, of which the largest says what an unexplained one amounts to; and
/// what the transfer has taken out since.
template <class G>
std::array<double, 6> energy_scales(const Model<G>& model, double kinetic, double stored)
{
  const EnergyBook& book = model.energy;
  const auto [external, of_stresses] = works_so_far(model);
  return {std::isnan(stored) ? 0 : stored, external, of_stresses, kinetic, book.kinetic_start,
          book.pic_loss - book.pic_start};
}
} // namespace

template <class G>
Diagnostics diagnostics(const Model<G>& model)
{
  constexpr int D = G::dim;
  const Particles<D>& particles = model.particles;
  Diagnostics d{};
  d.particles = particles.size();
  for (Index p = 0; p < particles.size(); ++p)
  {
    const Vector<D> momentum = particle_momentum(model, p);
    d.mass += particles.mass[p];
    for (int i = 0; i < D; ++i)
      d.momentum[i] += momentum[i];
  }
  if (!model.failure)
    check_conservation(model, d);
  if (has_two_phases(model))
    for (Index p = 0; p < particles.size(); ++p)
    {
      d.mass += particles.water_mass[0][p];
      for (int i = 0; i < D; ++i)
        d.momentum[i] += particles.water_mass[0][p] * particles.water_velocity[i][p];
    }
  d.external_work = model.totals.external_work;
  d.internal_work = model.totals.internal_work;
  d.damping_work = model.totals.damping_work;
  d.support_work = model.totals.support_work;
  d.drag_work = model.totals.drag_work;
  d.friction_work = model.totals.friction_work;
  take_energies(model, d);
  auto scales = energy_scales(model, d.kinetic_energy, d.stored_energy);
  MPI_Allreduce(MPI_IN_PLACE, scales.data(), static_cast<int>(scales.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  d.outflow_particles = static_cast<double>(model.totals.outflow_particles);
  d.outflow_mass = model.totals.outflow_mass;
  d.particle_steps = static_cast<double>(model.totals.particle_steps);
  d.plastic_fraction = static_cast<double>(model.last.plastic);
  d.resting_cells = static_cast<double>(model.fields.front().resting.runs.size());
  d.converted_cells = static_cast<double>(model.totals.converted_cells);
  std::array<double, sizeof(Diagnostics) / sizeof(double)> sums;
  std::copy_n(&d.particles, sums.size(), sums.begin());
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  std::copy_n(sums.begin(), sums.size(), &d.particles);
  d.plastic_fraction = d.particles > 0 ? d.plastic_fraction / d.particles : 0;
  d.unexplained_energy += std::min(0.0, scales.back()); // what a transfer of velocities generates
  d.energy_scale = model.energy.largest_work;
  for (double scale : scales)
    d.energy_scale = std::max(d.energy_scale, std::abs(scale));
  d.unbalanced_ratio = out_of_balance(model, gravity_at(model, model.time));
  return d;
}

#define INSTANTIATE(G)                                                                                                 \
  template std::string failure_text(const Model<G>&, const Failure<G::dim>&);                                          \
  template std::int64_t run_explicit(Model<G>&, const ExplicitOptions&, const RunOptions&);                            \
  template Diagnostics diagnostics(const Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
