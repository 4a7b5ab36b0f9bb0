#include "model/particle_pass.h"

#include "materials/laws/substeps.h"
#include "mesh/search.h"
#include "model/batch_strain.h"
#include "model/law_increment.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <numeric>

namespace mpm
{
namespace
{
/// Steps after which the moments of all cells are gathered from the particles again, so that round-off does not add up.
constexpr std::int64_t gathering_interval = 64;

/// What sorting costs per particle, over what a stray costs more in a step than a particle in its place.
constexpr double sort_cost = 0.8;

/// A second chance for the particles whose law failed, unless the step is lost anyway.
template <int D>
void update_failed(Model<D>& model, const Batch& batch, const PointBatch<D>& points, const std::vector<Index>& failed)
{
  if (model.work.trouble)
    return;
  const BatchReport report = update_in_parts<D>(model.laws[batch.material], points, failed);
  model.last.plastic += report.plastic;
  if (report.failed.empty())
    return;
  SymTensor<D> increment;
  for (int k = 0; k < n_stress<D>; ++k)
    increment[k] = points.strain_increment[k][report.failed.front()];
  note_trouble<D>(model, Trouble<D>::Kind::law_failed_in_parts, batch.first + report.failed.front(), increment);
}

/// Half of the work of a batch's stresses on the strains in the scratch, particle by particle.
template <int D>
double half_work(const Particles<D>& particles, const Batch& batch, const BatchScratch<D>& scratch)
{
  double sum = 0;
  for (Index p = batch.first; p < batch.last; ++p)
    for (int k : stress_component<D>)
      sum += particles.volume[p] * particles.stress[k][p] * scratch.strain[k][p - batch.first];
  return 0.5 * sum;
}

/// Half of the work of a sum of stresses, V sigma, on the strain of a run of the batch.
template <int D>
double half_work(const std::array<double, n_symmetric<D>>& stress, const BatchScratch<D>& scratch, std::size_t run)
{
  const auto& increment = scratch.cells[run / lanes].increment;
  double sum = 0;
  for (std::size_t k = 0; k < n_symmetric<D>; ++k)
    sum += stress[k] * increment[stress_component<D>[k]][run % lanes];
  return 0.5 * sum;
}

/// Kinetic energy that PIC takes out of the particles of a run: their own velocities v go towards those of the nodes,
/// v + s (w - v), which costs m s d . (v - s d / 2) with d = v - w.
template <int D>
double pic_loss(const Model<D>& model, const Run& run, double share)
{
  const Workspace<D>& work = model.work;
  const auto start = [&](Index i) -> const Vector<D>& { return work.start_velocity[i]; };
  const AffineField<D> field = affine_field<D>(model.mesh, run.cell, start);
  const Vector<D>& centre = model.mesh.shapes[run.cell].centre;
  const Particles<D>& particles = model.particles;
  double sum = 0;
  for (Index p = run.first; p < run.last; ++p)
    for (int a = 0; a < D; ++a)
    {
      double w = field.value[a];
      for (int b = 0; b < D; ++b)
        w += field.gradient[a][b] * (particles.position[b][p] - centre[b]);
      const double v = particles.velocity[a][p], change = share * (v - w);
      sum += particles.mass[p] * change * (v - 0.5 * change);
    }
  return sum;
}

template <int D>
void update_stress(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  Particles<D>& particles = model.particles;
  strain_batch(model, options, batch, scratch);
  const bool dual = model.integration == Integration::dual_domain;
  if (dual)
    model.energy.stress_work += half_work(particles, batch, scratch);

  PointBatch<D> points;
  points.size = batch.last - batch.first;
  for (int k = 0; k < n_stress<D>; ++k)
  {
    points.strain_increment[k] = scratch.strain[k];
    points.stress[k] = particles.stress[k].data() + batch.first;
  }
  std::array<double*, max_states> state;
  for (std::size_t k = 0; k < particles.state.size(); ++k)
    state[k] = particles.state[k].data() + batch.first;
  points.state = state.data();
  points.time = model.time;
  points.dt = options.law_dt;
  LawIncrement<D> columns;
  give_cell_sizes(model, batch, columns, points);
  if (!options.small && model.integration != Integration::dual_domain)
    give_deformation(
        model, batch, [&](std::size_t r) { return scratch.motion[r].displacement.gradient; },
        [&](std::size_t r) { return scratch.cells[r / lanes].volumetric[r % lanes]; }, columns, points);
  const BatchReport report = update<D>(model.laws[batch.material], points);
  model.last.plastic += report.plastic;
  if (!report.failed.empty())
    update_failed(model, batch, points, report.failed);
  if (dual)
    model.energy.ahead += half_work(particles, batch, scratch);
}

/// The new cell of a particle that is no longer in its old one; `none` when it is not to be gathered.
template <int D>
Index new_cell(Model<D>& model, Index p)
{
  Workspace<D>& work = model.work;
  const Location found = find_cell<D>(model.mesh, at<D>(model.particles.position, p), model.particles.cell[p]);
  if (found.cell == none && found.exit_cell == none)
    note_trouble<D>(model, Trouble<D>::Kind::not_finite, p, {});
  else if (found.cell == none || !is_within_reach(model.exchange, model.mesh.cell_owners[found.cell]))
    work.lost.push_back(p);
  else if (found.cell < model.mesh.owned_cells)
    return found.cell;
  else
    work.leavers.push_back({p, model.mesh.global_cells[found.cell], model.mesh.cell_owners[found.cell]});
  return none;
}

template <int D>
void gather_tractions(Model<D>& model, Index first, Index last, Index cell)
{
  if (!model.work.tractions.empty())
    gather<D>(model.particles, first, last, model.mesh.shapes[cell], model.work.tractions[cell]);
}

/// Takes out of a cell's moments the particles of a run that have left it, and notes where they went.
template <int D>
void follow_strays(Model<D>& model, const Run& run)
{
  Workspace<D>& work = model.work;
  const CellShape<D>& shape = model.mesh.shapes[run.cell];
  for (Index p = run.first; p < run.last; ++p)
  {
    const Index cell = new_cell(model, p);
    if (cell == run.cell)
      continue;
    CellMoments<D> moments{};
    gather<D>(model.particles, p, p + 1, shape, moments);
    take_out(moments, work.moments[run.cell]);
    if (!work.tractions.empty())
    {
      TractionMoments<D> tractions{};
      gather<D>(model.particles, p, p + 1, shape, tractions);
      take_out(tractions, work.tractions[run.cell]);
    }
    work.left.push_back(run.cell);
    if (cell == none)
      continue;
    model.particles.cell[p] = cell;
    work.strayed.push_back(p);
  }
}

/// What the moments of a cell become when its particles move along with the nodes, whoever they are: only stresses are
/// summed over particles, run by run, and tractions, which are rare.
template <int D>
void update_moments(Model<D>& model, const PassOptions& options, const Run& run, const CellMotion<D>& motion,
                    const BatchScratch<D>& scratch, std::size_t in_batch)
{
  CellMoments<D>& moments = model.work.moments[run.cell];
  if (run.first_in_cell && options.move)
    move<D>(moments, motion);
  if (run.first_in_cell && options.stress)
  {
    moments.volume *= 1 + scratch.cells[in_batch / lanes].volumetric[in_batch % lanes];
    moments.stress = {};
  }
  if (options.stress)
  {
    const auto sum = stress_sum<D>(model.particles, run.first, run.last);
    for (int k = 0; k < n_symmetric<D>; ++k)
      moments.stress[k] += sum[k];
    model.energy.ahead += half_work<D>(sum, scratch, in_batch);
  }
}

/// Gathers the particles of a run once more, so that round-off in the moments does not add up.
template <int D>
void gather_anew(Model<D>& model, const PassOptions& options, const Run& run, const BatchScratch<D>& scratch,
                 std::size_t in_batch)
{
  CellMoments<D>& moments = model.work.moments[run.cell];
  if (run.first_in_cell)
    moments = {};
  gather<D>(model.particles, run.first, run.last, model.mesh.shapes[run.cell], moments);
  if (options.stress && model.integration != Integration::dual_domain)
    model.energy.ahead += half_work<D>(stress_sum<D>(model.particles, run.first, run.last), scratch, in_batch);
}

/// Gathers particles that came into cells of this rank, from its own cells or from other ranks.
template <int D>
void gather_entered(Model<D>& model, std::span<const Index> particles)
{
  std::vector<Index> cells;
  for (Index p : particles)
  {
    const Index cell = model.particles.cell[p];
    gather<D>(model.particles, p, p + 1, model.mesh.shapes[cell], model.work.moments[cell]);
    gather_tractions<D>(model, p, p + 1, cell);
    cells.push_back(cell);
  }
  add_cells<D>(model.mesh, cells, model.work.soil);
}
} // namespace

template <int D>
void particle_pass(Model<D>& model, const PassOptions& options)
{
  const PhaseTimer timer(model.phase_seconds, Phase::particles);
  Workspace<D>& work = model.work;
  // The particles of a dual domain grow each in its own way, so that their volumes do not follow from the cell's
  // strain.
  const bool dual = model.integration == Integration::dual_domain;
  const bool anew = dual || model.totals.steps % gathering_interval == 0;
  if (!work.tractions.empty())
    for (Index c : work.soil.cells)
      work.tractions[c] = {};
  if (options.stress)
  {
    model.last.plastic = 0;
    model.energy.ahead = 0;
  }
  BatchScratch<D> scratch{};

  for (std::size_t r = 0; r < work.runs.size();)
  {
    const Batch batch = next_batch(work.runs, r);
    find_motions(model, options, batch, scratch);
    for (r = batch.first_run; options.move && options.pic_share > 0 && r < batch.last_run; ++r)
      model.energy.pic_loss += pic_loss(model, work.runs[r], options.pic_share);
    if (options.move)
      for (r = batch.first_run; r < batch.last_run; ++r)
      {
        Run& run = work.runs[r];
        run.scattered = !move_particles<D>(model.particles, run.first, run.last, model.mesh.shapes[run.cell],
                                           scratch.motion[r - batch.first_run]);
      }
    if (options.stress)
      update_stress<D>(model, options, batch, scratch);
    for (r = batch.first_run; r < batch.last_run; ++r)
    {
      const Run& run = work.runs[r];
      const std::size_t i = r - batch.first_run;
      if (run.first_in_cell && options.stress && !dual)
        model.energy.stress_work += half_work<D>(work.moments[run.cell].stress, scratch, i);
      if (anew)
        gather_anew<D>(model, options, run, scratch, i);
      else
        update_moments<D>(model, options, run, scratch.motion[i], scratch, i);
      gather_tractions<D>(model, run.first, run.last, run.cell);
      if (run.scattered)
        follow_strays<D>(model, run);
    }
  }
  if (options.stress)
    model.energy.stress_work += model.energy.ahead;
  if (work.strayed.empty())
    return;
  gather_entered<D>(model, work.strayed);
  work.strays += static_cast<Index>(work.strayed.size());
  work.strayed.clear();
  if (work.leavers.empty() && work.lost.empty())
    find_cell_runs(model, true);
}

template <int D>
void settle_particles(Model<D>& model)
{
  const PhaseTimer timer(model.phase_seconds, Phase::settling);
  Workspace<D>& work = model.work;
  const bool gone = !work.leavers.empty() || !work.outflow.empty();
  for (Index p : work.outflow)
  {
    const ParticleEnergy energy = particle_energy(model, p);
    model.totals.outflow_mass += model.particles.mass[p];
    model.energy.outflow_kinetic += energy.kinetic;
    model.energy.outflow_stored += energy.stored;
  }
  model.totals.outflow_particles += static_cast<std::int64_t>(work.outflow.size());
  const Index arrived =
      migrate<D>(work.owned_cells, model.exchange, {work.leavers, work.outflow, work.far_partners}, model.particles);
  work.leavers.clear();
  work.outflow.clear();
  work.far_partners.clear();
  std::vector<Index> arrivals(static_cast<std::size_t>(arrived));
  std::iota(arrivals.begin(), arrivals.end(), model.particles.size() - arrived);
  gather_entered<D>(model, arrivals);
  work.strays += arrived;

  // Strays cut the runs of two cells. Sorting is due when they have cost as much as it does.
  work.stray_steps += work.strays;
  if (static_cast<double>(work.stray_steps) > sort_cost * model.particles.size())
    sort_particles(model);
  else if (gone || arrived > 0)
    find_cell_runs(model, false);
}

#define INSTANTIATE(D)                                                                                                 \
  template void particle_pass(Model<D>&, const PassOptions&);                                                          \
  template void settle_particles(Model<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
