#include "model/particle_pass.h"

#include "materials/laws/substeps.h"
#include "model/cell_change.h"
#include "model/strain_kind.h"
#include "transfer/affine_field.h"
#include "transfer/resting.h"

#include <algorithm>

namespace mpm::model
{
namespace
{
/// Steps after which the moments of all cells are summed over the particles again, so that round-off does not add up.
constexpr std::int64_t summation_interval = 64;

/// A second chance for the particles whose law failed, unless the step is lost anyway.
template <class G, int D = G::dim>
void update_failed(Model<G>& model, const Batch& batch, const PointBatch<D>& points, const std::vector<Index>& failed)
{
  if (model.failure)
    return;
  const BatchReport report = update_in_parts<D>(model.laws[batch.material], points, failed);
  model.last.plastic += report.plastic;
  if (report.failed.empty())
    return;
  SymTensor<D> increment;
  for (int k = 0; k < n_stress<D>; ++k)
    increment[k] = points.strain_increment[k][report.failed.front()];
  note_failure<D>(model.failure, model.particles, Failure<D>::Kind::law_failed_in_parts,
                  batch.first + report.failed.front(), increment);
}

/// Kinetic energy that PIC takes out of the particles of a run: their own velocities v go towards those of the nodes,
/// v + s (w - v), which costs m s d . (v - s d / 2) with d = v - w.
template <class G, int D = G::dim>
double pic_loss(const Mesh<D>& mesh, const Particles<D>& particles, const VelocityField<G>& field, const Run& run,
                double pic_fraction)
{
  const auto start = [&](Index i) -> const Vector<D>& { return field.start_velocity[i]; };
  const AffineField<D> nodal = affine_field<D>(mesh, run.cell, start);
  const Vector<D>& centre = mesh.shapes[run.cell].centre;
  double sum = 0;
  for (Index p = run.first; p < run.last; ++p)
    for (int a = 0; a < D; ++a)
    {
      double w = nodal.value[a];
      for (int b = 0; b < D; ++b)
        w += nodal.gradient[a][b] * (particles.position[b][p] - centre[b]);
      const double v = particles.velocity[a][p], change = pic_fraction * (v - w);
      sum += particles.mass[p] * change * (v - 0.5 * change);
    }
  return sum;
}

template <class Kind, class G, int D = G::dim>
void update_stress(Model<G>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  Particles<D>& particles = model.particles;
  const VelocityField<G>& field = field_of(model, batch.material);
  Kind::strain(model.mesh, field, model.order.runs, options, batch, particles, scratch);
  model.energy.stress_work += Kind::template half_work_of_batch<G>(particles, batch, scratch);

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
  give_cell_sizes(model.mesh, material_points(model), batch, columns, points);
  if (!options.small)
    Kind::deform(material_points(model), batch, scratch, columns, points);
  const BatchReport report = update<D>(model.laws[batch.material], points);
  model.last.plastic += report.plastic;
  if (!report.failed.empty())
    update_failed(model, batch, points, report.failed);
  model.energy.ahead += Kind::template half_work_of_batch<G>(particles, batch, scratch);
}

/// Keeps the sum of stresses of a run, for the work of the batch.
template <class G>
void note(const Working<G>& stress, std::size_t run, double (&by_run)[n_stress<G::dim>][batch_size])
{
  for (int k = 0; k < G::n_working; ++k)
    by_run[k][run] = stress[k];
}

/// What the moments of a cell become when its particles move along with the nodes, whoever they are: only stresses are
/// summed over particles, run by run, and tractions, which are rare.
template <class G, int D = G::dim>
void update_moments(const Particles<D>& particles, const PassOptions& options, const Run& run, std::size_t in_batch,
                    BatchScratch<D>& scratch, CellMoments<G>& moments)
{
  if (run.first_in_cell && options.move)
    move<G>(moments, scratch.motion[in_batch]);
  if (run.first_in_cell && options.stress)
  {
    moments.volume *= 1 + scratch.cells[in_batch / lanes].volumetric[in_batch % lanes];
    moments.stress = {};
  }
  if (options.stress)
  {
    const auto sum = stress_sum<G>(particles, run.first, run.last);
    for (int k = 0; k < G::n_working; ++k)
      moments.stress[k] += sum[k];
    note<G>(sum, in_batch, scratch.stress_after);
  }
}

/// The same of a resting cell, whose particles have velocities v + grad v . xi.
template <class G, int D = G::dim>
double pic_loss_at_rest(const Particles<D>& particles, const VelocityField<G>& field, const Mesh<D>& mesh,
                        const Run& run, double pic_fraction)
{
  const auto start = [&](Index i) -> const Vector<D>& { return field.start_velocity[i]; };
  const AffineField<D> nodal = affine_field<D>(mesh, run.cell, start);
  Matrix<D> half = gradient_at<D>(particles.velocity_gradient, run.first), change;
  double sum = 0;
  for (int a = 0; a < D; ++a)
  {
    const double v = particles.velocity[a][run.first], of_centre = pic_fraction * (v - nodal.value[a]);
    sum += particles.mass[run.first] * of_centre * (v - 0.5 * of_centre);
    for (int b = 0; b < D; ++b)
    {
      change[a][b] = pic_fraction * (half[a][b] - nodal.gradient[a][b]);
      half[a][b] -= 0.5 * change[a][b];
    }
  }
  return sum + relative_product<D>(change, half, field.moments[run.cell].mass_xixi);
}

/// Moves the particles of a batch, and marks the runs that some have left.
template <class Kind, class G, int D = G::dim>
void move_batch(Model<G>& model, const VelocityField<G>& field, const PassOptions& options, const Batch& batch,
                const BatchScratch<D>& scratch)
{
  auto& runs = model.order.runs;
  Particles<D>& particles = model.particles;
  for (std::size_t r = batch.first_run; options.pic_fraction > 0 && r < batch.last_run; ++r)
    if constexpr (Kind::at_rest)
      model.energy.pic_loss += pic_loss_at_rest(particles, field, model.mesh, runs[r], options.pic_fraction);
    else
      model.energy.pic_loss += pic_loss(model.mesh, particles, field, runs[r], options.pic_fraction);
  if constexpr (Kind::at_rest)
  {
    const Index failed =
        move_rows<D>(particles, batch.first, std::span(scratch.motion).first(batch.last_run - batch.first_run));
    if (failed < batch.last)
      note_failure<D>(model.failure, particles, Failure<D>::Kind::not_finite, failed, {});
  }
  else
    for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
      runs[r].out_of_order = !move_particles<D>(particles, runs[r].first, runs[r].last, model.mesh.shapes[runs[r].cell],
                                                scratch.motion[r - batch.first_run]);
}

/// Moves and strains the particles of a batch, and brings the moments of their cells to where they are then.
/// @param from_particles  sum the moments over the particles, instead of following the motion of the cell
template <class Kind, class G, int D = G::dim>
void pass_batch(Model<G>& model, const PassOptions& options, const Batch& batch, bool from_particles,
                BatchScratch<D>& scratch)
{
  VelocityField<G>& field = field_of(model, batch.material);
  auto& runs = model.order.runs;
  find_motions(model.mesh, field, runs, options, batch, scratch);
  if (options.move)
    move_batch<Kind>(model, field, options, batch, scratch);
  if (options.stress)
    update_stress<Kind>(model, options, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = runs[r];
    const CellShape<D>& shape = model.mesh.shapes[run.cell];
    const std::size_t i = r - batch.first_run;
    CellMoments<G>& moments = field.moments[run.cell];
    note<G>(run.first_in_cell ? moments.stress : Working<G>{}, i, scratch.stress_before);
    if constexpr (Kind::at_rest)
    {
      take_row<G>(model.particles, run.first, moments);
      note<G>(moments.stress, i, scratch.stress_after);
    }
    else if (from_particles)
    {
      if (run.first_in_cell)
        moments = {};
      add_moments<G>(model.particles, run.first, run.last, shape, moments);
      note<G>(stress_sum<G>(model.particles, run.first, run.last), i, scratch.stress_after);
    }
    else if constexpr (Kind::moves_moments)
      update_moments<G>(model.particles, options, run, i, scratch, moments);
    add_tractions(model.particles, shape, run.first, run.last, run.cell, field);
    if (run.out_of_order)
      follow_leaving(model, run, field);
  }
  if (options.stress)
  {
    const std::size_t n = batch.last_run - batch.first_run;
    model.energy.stress_work += Kind::template half_work_of_runs<G>(scratch.stress_before, scratch, n);
    model.energy.ahead += Kind::template half_work_of_runs<G>(scratch.stress_after, scratch, n);
  }
}

/// The pass over all batches.
template <class Kind, class G>
void pass_batches(Model<G>& model, const PassOptions& options)
{
  const bool from_particles = !Kind::moves_moments || model.totals.steps % summation_interval == 0;
  BatchScratch<G::dim> scratch{};
  for (std::size_t r = 0; r < model.order.runs.size();)
  {
    const Batch batch = next_batch(model.order.runs, r);
    if (batch.resting)
      pass_batch<StrainAtRest>(model, options, batch, from_particles, scratch);
    else
      pass_batch<Kind>(model, options, batch, from_particles, scratch);
    r = batch.last_run;
  }
}
} // namespace

template <class G>
void particle_pass(Model<G>& model, const PassOptions& options)
{
  for (VelocityField<G>& field : model.fields)
    if (!field.tractions.empty())
      for (Index c : field.part.cells)
        field.tractions[c] = {};
  if (options.stress)
  {
    model.last.plastic = 0;
    model.energy.ahead = 0;
  }
  if (model.fields.front().integration.kind == Integration::dual_domain)
    pass_batches<StrainPerParticle>(model, options);
  else
    pass_batches<StrainPerCell>(model, options);
  if (options.stress)
    model.energy.stress_work += model.energy.ahead;
  Migration& migration = model.migration;
  if (migration.entered.empty())
    return;
  add_entered(model.mesh, model.particles, migration.entered, model.field_of_law, model.fields);
  note_disturbed(model, migration.entered);
  model.order.out_of_order += static_cast<Index>(migration.entered.size());
  migration.entered.clear();
  if (migration.migrating.empty() && migration.lost.empty())
    find_cell_runs(model, true);
}

#define INSTANTIATE(G) template void particle_pass(Model<G>&, const PassOptions&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
