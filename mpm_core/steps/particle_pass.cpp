#include "steps/particle_pass.h"

#include "base/work_columns.h"
#include "materials/substeps.h"
#include "mesh/search.h"
#include "steps/batches.h"
#include "steps/integration.h"
#include "transfer/kinematics.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// What the nodes do to the particles. A PIC share of v_p is replaced by the grid's sum N_i (v_i + dt a_i).
template <int D>
void find_motion(Model<D>& model, const PassOptions& options)
{
  Workspace<D>& work = model.work;
  work.motion.resize(model.mesh.points.size());
  for (std::size_t i = 0; i < work.motion.size(); ++i)
    for (int a = 0; a < D; ++a)
    {
      work.motion[i][a] = options.dt * work.acceleration[i][a] + options.pic_share * work.start_velocity[i][a];
      work.motion[i][D + a] = options.dt * work.velocity[i][a];
    }
}

/// Room for a batch, in the first-level cache.
template <int D>
struct BatchScratch
{
  WorkColumns<Matrix<D>> gradient;                    ///< of the velocity, per run
  WorkColumn<double> theta;                           ///< averaged volumetric strain, per run
  WorkColumns<CellStrain<D>> cells;                   ///< per run
  alignas(64) double strain[n_stress<D>][batch_size]; ///< per particle, one column per component
};

/// Strains of the cells of a batch, from the nodes' velocities.
template <int D>
void find_cell_strains(const Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  const std::size_t n = batch.last_run - batch.first_run;
  const auto velocity = [&](Index i) -> const Vector<D>& { return model.work.velocity[i]; };
  for (std::size_t r = 0; r < n; ++r)
  {
    const Index cell = model.work.runs[batch.first_run + r].cell;
    scratch.gradient.set(r, affine_field<D>(model.mesh, cell, velocity).gradient);
    scratch.theta[r] = options.averaged ? model.work.volumetric_strain[cell] : 0;
  }
  const double dt = options.dt;
#pragma GCC ivdep
  for (std::size_t r = 0; r < n; ++r)
    scratch.cells.set(r, strain_increment<D>(scratch.gradient.at(r), dt));
  if (options.averaged)
#pragma GCC ivdep
    for (std::size_t r = 0; r < n; ++r)
    {
      CellStrain<D> strain = scratch.cells.at(r);
      set_volumetric(strain, scratch.theta[r]);
      scratch.cells.set(r, strain);
    }
}

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

/// Strains the particles of a batch, those of a cell alike.
template <int D>
void strain_cells(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  find_cell_strains(model, options, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = model.work.runs[r];
    const CellStrain<D> strain = scratch.cells.at(r - batch.first_run);
    for (int k = 0; k < n_stress<D>; ++k)
      std::fill(scratch.strain[k] + (run.first - batch.first), scratch.strain[k] + (run.last - batch.first),
                strain.increment[k]);
    strain_particles<D>(model.particles, run.first, run.last, strain);
  }
}

/// Strains the particles of a batch, each by the gradient at its own place.
template <int D>
void strain_dual_domains(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = model.work.runs[r];
    for (Index p = run.first; p < run.last; ++p)
    {
      CellStrain<D> strain = strain_increment<D>(dual_gradient(model, p, run.cell), options.dt);
      if (options.averaged)
        set_volumetric(strain, model.work.volumetric_strain[run.cell]);
      for (int k = 0; k < n_stress<D>; ++k)
        scratch.strain[k][p - batch.first] = strain.increment[k];
      strain_particles<D>(model.particles, p, p + 1, strain);
    }
  }
}

template <int D>
void update_stress(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  Particles<D>& particles = model.particles;
  if (model.integration == Integration::dual_domain)
    strain_dual_domains(model, options, batch, scratch);
  else
    strain_cells(model, options, batch, scratch);

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
  const BatchReport report = update<D>(model.laws[batch.material], points);
  model.last.plastic += report.plastic;
  if (!report.failed.empty())
    update_failed(model, batch, points, report.failed);
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
void gather_run(Model<D>& model, Index first, Index last, Index cell)
{
  gather<D>(model.particles, first, last, model.mesh.shapes[cell], model.work.moments[cell]);
  if (!model.work.tractions.empty())
    gather<D>(model.particles, first, last, model.mesh.shapes[cell], model.work.tractions[cell]);
}

/// Finds the cells of a run in which some particle left the run's cell, and gathers them piece by piece.
template <int D>
void gather_scattered(Model<D>& model, const Run& run)
{
  Index piece = run.first, piece_cell = none;
  auto close = [&](Index p)
  {
    if (piece_cell != none && p > piece)
      gather_run<D>(model, piece, p, piece_cell);
  };
  for (Index p = run.first; p < run.last; ++p)
  {
    const Index cell = new_cell(model, p);
    if (cell != none && cell != model.particles.cell[p])
    {
      model.particles.cell[p] = cell;
      ++model.work.strays;
    }
    if (cell != piece_cell)
    {
      close(p);
      piece = p;
      piece_cell = cell;
    }
  }
  close(run.last);
}
} // namespace

template <int D>
void particle_pass(Model<D>& model, const PassOptions& options)
{
  Workspace<D>& work = model.work;
  std::fill(work.moments.begin(), work.moments.end(), CellMoments<D>{});
  std::fill(work.tractions.begin(), work.tractions.end(), TractionMoments<D>{});
  if (options.stress)
    model.last.plastic = 0;
  const Index strays_before = work.strays;
  if (options.move)
    find_motion(model, options);
  std::array<bool, batch_size> scattered;
  BatchScratch<D> scratch;

  for (std::size_t r = 0; r < work.runs.size();)
  {
    const Batch batch = next_batch(work.runs, r);
    if (options.move)
      for (r = batch.first_run; r < batch.last_run; ++r)
      {
        const Run& run = work.runs[r];
        scattered[r - batch.first_run] =
            move_particles<D>(model.particles, run, model.mesh, work.motion, 1 - options.pic_share) > 0;
      }
    if (options.stress)
      update_stress<D>(model, options, batch, scratch);
    for (r = batch.first_run; r < batch.last_run; ++r)
    {
      const Run& run = work.runs[r];
      if (options.move && scattered[r - batch.first_run])
        gather_scattered<D>(model, run);
      else
        gather_run<D>(model, run.first, run.last, run.cell);
    }
  }
  if (work.strays != strays_before && work.leavers.empty() && work.lost.empty())
    find_runs<D>(model.particles, batch_size, work.runs);
}

template <int D>
void settle_particles(Model<D>& model)
{
  Workspace<D>& work = model.work;
  const bool gone = !work.leavers.empty() || !work.outflow.empty();
  for (Index p : work.outflow)
    model.totals.outflow_mass += model.particles.mass[p];
  model.totals.outflow_particles += static_cast<std::int64_t>(work.outflow.size());
  const Index arrived =
      migrate<D>(work.owned_cells, model.exchange, {work.leavers, work.outflow, work.far_partners}, model.particles);
  work.leavers.clear();
  work.outflow.clear();
  work.far_partners.clear();
  for (Index p = model.particles.size() - arrived; p < model.particles.size(); ++p)
    gather_run<D>(model, p, p + 1, model.particles.cell[p]);
  work.strays += arrived;

  // Strays cut the runs of two cells; sorting costs about two steps, so it waits until a tenth of the particles
  // strayed.
  if (work.strays > model.particles.size() / 10 && model.totals.steps - work.last_sort > 50)
    sort_particles(model);
  else if (gone || arrived > 0)
    find_runs<D>(model.particles, batch_size, work.runs);
}

#define INSTANTIATE(D)                                                                                                 \
  template void particle_pass(Model<D>&, const PassOptions&);                                                          \
  template void settle_particles(Model<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
