#include "explicit/run.h"

#include "materials/laws/substeps.h"
#include "parallel/agreement.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace mpm
{
namespace
{
template <std::size_t N>
std::string show(const std::array<double, N>& values)
{
  std::ostringstream out;
  out.precision(6);
  for (std::size_t i = 0; i < N; ++i)
    out << (i ? ", " : "(") << values[i];
  return out.str() + ")";
}

} // namespace

template <int D>
std::string trouble_text(const Model<D>& model, const Trouble<D>& trouble)
{
  std::ostringstream out;
  out.precision(9);
  out << "particle " << trouble.particle << " at " << show(trouble.position) << " m with velocity "
      << show(trouble.velocity) << " m/s ";
  switch (trouble.kind)
  {
  case Trouble<D>::Kind::left_mesh:
    out << "left the background mesh; where the soil is to stay, support it there (model.fix, model.roller), else "
           "extend the mesh "
           "or name the facets as outflow";
    break;
  case Trouble<D>::Kind::not_finite:
    out << "has a position that is not a number; the step may be too large for the stiffness";
    break;
  case Trouble<D>::Kind::law_failed:
  case Trouble<D>::Kind::law_failed_in_parts:
    out << "follows the law " << law_name(model.laws[static_cast<std::size_t>(trouble.material)]) << " (number "
        << trouble.material << "), which failed for the strain increment " << show(trouble.strain_increment);
    if (trouble.kind == Trouble<D>::Kind::law_failed_in_parts)
      out << ", also when it was cut into " << most_parts << " parts";
    break;
  case Trouble<D>::Kind::lost_volume:
    out << "is in a cell that would lose its volume by the strain increment " << show(trouble.strain_increment);
    break;
  }
  out << " (in the step after t = " << model.time << " s)";
  return out.str();
}

namespace
{
template <int D>
double next_step(const Model<D>& model, const RunOptions& run, double critical)
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

template <int D>
std::int64_t run_explicit(Model<D>& model, const ExplicitOptions& options, const RunOptions& run)
{
  prepare(model);
  ExplicitOptions of_step = options;
  std::int64_t done = 0;
  double dt = 0;
  const double closeness = 1e-9 * std::abs(run.until);
  while (run.until - model.time > closeness && (run.max_steps == 0 || done < run.max_steps))
  {
    if (done % control_interval == 0)
    {
      const double critical = critical_time_step(model);
      dt = next_step(model, run, critical);
      of_step.pic_share = pic_share_of_step(run.pic, dt, critical);
    }
    explicit_step(model, of_step, dt);
    if (model.work.trouble)
      throw RunError(trouble_text(model, *model.work.trouble));
    ++done;
  }
  if (run.until - model.time <= closeness)
    model.time = run.until;
  return done;
}

namespace
{
/// Each particle must be in exactly one cell's sums, and none may have been lost or doubled between ranks.
/// @throws RunError on all ranks
template <int D>
void check_conservation(const Model<D>& model, const Diagnostics& local)
{
  const Inventory now = taken_inventory(model);
  std::ostringstream out;
  out.precision(17);
  if (now.particles != model.inventory.particles || std::abs(now.mass - model.inventory.mass) > 1e-9 * now.mass)
    out << "the ranks hold " << now.particles << " particles of " << now.mass << " kg, those that flowed out included; "
        << "there were " << model.inventory.particles << " of " << model.inventory.mass << " kg";
  std::array<double, 4> cells{};
  double scale = 0;
  for (const CellMoments<D>& moments : model.work.moments)
  {
    cells[0] += moments.mass;
    for (int i = 0; i < D; ++i)
      cells[static_cast<std::size_t>(i) + 1] += moments.momentum[i];
  }
  for (Index p = 0; p < model.particles.size(); ++p)
    scale += model.particles.mass[p] * norm<D>(at<D>(model.particles.velocity, p));
  const std::array<double, 4> particles{local.mass, local.momentum[0], local.momentum[1], local.momentum[2]};
  for (std::size_t k = 0; k < 4; ++k)
    if (std::abs(cells[k] - particles[k]) > 1e-9 * (k == 0 ? local.mass : scale))
      out << "the cells of rank " << model.exchange.rank << " hold " << cells[k] << (k == 0 ? " kg" : " N s")
          << ", its particles " << particles[k];
  if (const std::string text = shared_failure(model.exchange.comm, out.str()); !text.empty())
    throw RunError("particles were lost or counted twice: " + text);
}
} // namespace

namespace
{
/// What is taken at particles and nodes, of this rank.
template <int D>
void take_energies(const Model<D>& model, Diagnostics& d)
{
  const EnergyBook& book = model.energy;
  const ParticleEnergy energy = particle_energy(model);
  d.kinetic_energy = energy.kinetic;
  d.stored_energy = energy.stored;
  d.stress_work = book.stress_work;
  d.plastic_work = book.stress_work - energy.stored - book.outflow_stored - book.plastic_start;
  d.pic_loss = book.pic_loss;
  d.unexplained_energy = energy_balance(model, energy.kinetic) - book.balance_start;
  for (Index i : model.work.soil.nodes)
    if (model.exchange.owned[i])
      d.nodal_kinetic_energy += 0.5 * model.work.nodes[i].mass * dot<D>(model.work.velocity[i], model.work.velocity[i]);
}

/// The works and energies since the balance began, of which the largest says what an unexplained one amounts to.
template <int D>
std::array<double, 5> energy_scales(const Model<D>& model, double kinetic, double stored)
{
  const EnergyBook& book = model.energy;
  return {std::isnan(stored) ? 0 : stored, model.totals.external_work + model.totals.support_work - book.external_start,
          book.stress_work - book.stress_start, kinetic, book.kinetic_start};
}
} // namespace

template <int D>
Diagnostics diagnostics(const Model<D>& model)
{
  const Particles<D>& particles = model.particles;
  Diagnostics d{};
  d.particles = particles.size();
  for (Index p = 0; p < particles.size(); ++p)
  {
    const Vector<D> v = at<D>(particles.velocity, p);
    d.mass += particles.mass[p];
    for (int i = 0; i < D; ++i)
      d.momentum[i] += particles.mass[p] * v[i];
  }
  if (!model.work.trouble)
    check_conservation(model, d);
  d.external_work = model.totals.external_work;
  d.internal_work = model.totals.internal_work;
  d.damping_work = model.totals.damping_work;
  d.support_work = model.totals.support_work;
  take_energies(model, d);
  auto scales = energy_scales(model, d.kinetic_energy, d.stored_energy);
  MPI_Allreduce(MPI_IN_PLACE, scales.data(), static_cast<int>(scales.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  d.outflow_particles = static_cast<double>(model.totals.outflow_particles);
  d.outflow_mass = model.totals.outflow_mass;
  d.particle_steps = static_cast<double>(model.totals.particle_steps);
  d.plastic_share = static_cast<double>(model.last.plastic);
  std::array<double, sizeof(Diagnostics) / sizeof(double)> sums;
  std::copy_n(&d.particles, sums.size(), sums.begin());
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  std::copy_n(sums.begin(), sums.size(), &d.particles);
  d.plastic_share = d.particles > 0 ? d.plastic_share / d.particles : 0;
  for (double scale : scales)
    d.energy_scale = std::max(d.energy_scale, std::abs(scale));
  d.unbalanced_ratio = out_of_balance<D>(model, current_gravity(model));
  return d;
}

#define INSTANTIATE(D)                                                                                                 \
  template std::string trouble_text(const Model<D>&, const Trouble<D>&);                                               \
  template std::int64_t run_explicit(Model<D>&, const ExplicitOptions&, const RunOptions&);                            \
  template Diagnostics diagnostics(const Model<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
