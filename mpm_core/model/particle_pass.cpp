#include "model/particle_pass.h"

#include "model/cell_change.h"
#include "model/law_update.h"
#include "model/pic_loss.h"
#include "model/resting_pass.h"
#include "model/strain_kind.h"
#include "transfer/affine_field.h"
#include "transfer/affine_momentum.h"

#include <algorithm>

namespace mpm::model
{
namespace
{
/// Steps after which the moments of all cells are summed over the particles again, so that round-off does not add up.
constexpr std::int64_t summation_interval = 64;

/// Notes cells that would have no volume left.
template <class G, int D = G::dim>
void note_lost_volume(Model<G>& model, const Batch& batch, const BatchScratch<D>& scratch)
{
  const std::size_t n = batch.last_run - batch.first_run;
  LaneMask lost{};
  for (std::size_t r = 0; r < n; r += lanes)
    lost |= scratch.cells[r / lanes].volumetric <= -1.0;
  std::int64_t any = 0;
  for (int l = 0; l < lanes; ++l)
    any |= lost[l];
  for (std::size_t r = 0; any && r < n; ++r)
    if (scratch.cells[r / lanes].volumetric[r % lanes] <= -1)
      note_failure<D>(model.failure, model.particles, Failure<D>::Kind::lost_volume,
                      model.order.runs[batch.first_run + r].first, scratch.cell_strain(r).increment);
}

template <class Kind, class G, int D = G::dim>
void update_stress(Model<G>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  Particles<D>& particles = model.particles;
  const VelocityField<G>& field = field_of(model, batch.material);
  Kind::strain(model.mesh, field, model.order.runs, options, batch, particles, scratch);
  model.energy.stress_work += Kind::template half_work_of_batch<G>(particles, batch, scratch);
  update_law<G>(model, material_points(model), options, batch, scratch.strain,
                [&](const MaterialPoints<D>& material, LawIncrement<D>& columns, PointBatch<D>& points)
                { Kind::deform(material, batch, scratch, columns, points); });
  model.energy.ahead += Kind::template half_work_of_batch<G>(particles, batch, scratch);
  if constexpr (Kind::moves_moments)
    note_lost_volume(model, batch, scratch);
}

/// Counts the particles of each cell. Those of other laws are in runs of their own, and so are those that have come
/// since the last sort: which runs there are depends on the ranks, and the motion must not.
template <class G>
void find_contents(Model<G>& model)
{
  CellOrder& order = model.order;
  order.contents.resize(static_cast<std::size_t>(model.mesh.owned_cells));
  for (const Run& run : order.runs)
    order.contents[static_cast<std::size_t>(run.cell)] = {};
  for (const Run& run : order.runs)
  {
    CellContent& content = order.contents[static_cast<std::size_t>(run.cell)];
    content.particles += run.last - run.first;
    for (Index p = run.first; p < run.last; ++p)
      content.mass += model.particles.mass[p];
  }
}

/// A vertex with less than this part of the mean mass of a cell's particles counts as light.
constexpr double part_of_light_vertex = 0.2;

/// Whether few particles are in a cell, one of whose vertices is light. The second mapping (19) gives such a vertex the
/// mean of the particles' changes of velocity, and nothing of their gradient: stresses hardly resist a gradient that is
/// carried on, and a particle at the surface, which goes to and fro between two cells, is shaken ever more by it.
template <class G, int D = G::dim>
bool is_sparse(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell, const CellContent& content)
{
  const double least = part_of_light_vertex * content.mass / content.particles;
  const auto is_light = [&](Index node) { return field.nodes[node].mass < least; };
  return content.particles <= D && std::ranges::any_of(mesh.cells[cell], is_light);
}

/// The gradient of their velocity that particles carry with affine transfer: PIC leaves a part of it out, and in sparse
/// cells only the spin is left, without which a body that turns would lose its angular momentum.
template <class G, int D = G::dim>
Matrix<D> carried_gradient(const Mesh<D>& mesh, const VelocityField<G>& field, const PassOptions& options, Index cell,
                           const CellContent& content, const CellMotion<D>& motion)
{
  Matrix<D> gradient = scaled<D>(motion.change, 1 - options.pic_fraction).gradient;
  if (is_sparse(mesh, field, cell, content))
    for (int a = 0; a < D; ++a)
      for (int b = 0; b <= a; ++b)
      {
        gradient[a][b] = 0.5 * (gradient[a][b] - gradient[b][a]);
        gradient[b][a] = -gradient[a][b];
      }
  return gradient;
}

/// Gives the particles of a run the gradient of their velocity.
template <int D>
void keep_gradient(Particles<D>& particles, const Run& run, const Matrix<D>& gradient)
{
  for (int k = 0; k < D * D; ++k)
  {
    const auto column = particles.velocity_gradient[k].begin();
    std::fill(column + run.first, column + run.last, gradient[k / D][k % D]);
  }
}

/// Keeps the sum of stresses of a run, for the work of the batch.
template <class G>
void note(const Working<G>& stress, std::size_t run, double (&by_run)[n_stress<G::dim>][batch_size])
{
  for (int k = 0; k < G::n_working; ++k)
    by_run[k][run] = stress[k];
}

/// The shape of a cell about its centre at the end of the step, where the cell moves with its particles; the gradients
/// are those of the start.
template <int D>
CellShape<D> about_moved_centre(CellShape<D> shape, const CellMotion<D>& motion)
{
  for (int a = 0; a < D; ++a)
    shape.centre[a] += motion.displacement.value[a];
  return shape;
}

/// What the moments of a cell become when its particles move along with the nodes, whoever they are: only stresses are
/// summed over particles, run by run, and tractions, which are rare.
template <class G, int D = G::dim>
void update_moments(const Mesh<D>& mesh, const Particles<D>& particles, const PassOptions& options, const Run& run,
                    std::size_t in_batch, BatchScratch<D>& scratch, CellMoments<G>& moments)
{
  if (run.first_in_cell && options.move)
  {
    CellMotion<D> motion = scratch.motion[in_batch];
    if (options.moving_cells)
      motion.displacement.value = {}; // the centre moves as much
    move<G>(moments, motion);
    if (options.transfer == Transfer::affine)
      add_affine_momentum<G>(scratch.carried[in_batch], spread_about_particles(mesh, run.cell, moments), moments);
  }
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

/// Moves the particles of a batch, and marks the runs that some have left.
template <class G, int D = G::dim>
void move_batch(Model<G>& model, const VelocityField<G>& field, const PassOptions& options, const Batch& batch,
                BatchScratch<D>& scratch)
{
  auto& runs = model.order.runs;
  Particles<D>& particles = model.particles;
  const bool affine = options.transfer == Transfer::affine;
  for (std::size_t r = batch.first_run; options.pic_fraction > 0 && !affine && r < batch.last_run; ++r)
    model.energy.pic_loss += pic_loss(model.mesh, particles, field, runs[r], options.pic_fraction,
                                      particles.mass.data(), [&](Index p, int a) { return particles.velocity[a][p]; });
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const CellMotion<D>& motion = scratch.motion[r - batch.first_run];
    if (affine)
    {
      Matrix<D>& carried = scratch.carried[r - batch.first_run];
      const Index cell = runs[r].cell;
      const CellContent& content = model.order.contents[static_cast<std::size_t>(cell)];
      carried = carried_gradient(model.mesh, field, options, cell, content, motion);
      keep_gradient<D>(particles, runs[r], carried);
    }
    const bool inside =
        move_particles<D>(particles, runs[r].first, runs[r].last, model.mesh.shapes[runs[r].cell], motion);
    runs[r].out_of_order = !inside && !options.moving_cells;
  }
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
    move_batch(model, field, options, batch, scratch);
  else if (options.count_displacement)
    for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
      count_displacement<D>(model.particles, runs[r].first, runs[r].last, model.mesh.shapes[runs[r].cell],
                            scratch.motion[r - batch.first_run]);
  if (options.stress)
    update_stress<Kind>(model, options, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = runs[r];
    const std::size_t i = r - batch.first_run;
    CellShape<D> moved;
    const CellShape<D>& shape = options.moving_cells
                                    ? moved = about_moved_centre(model.mesh.shapes[run.cell], scratch.motion[i])
                                    : model.mesh.shapes[run.cell];
    CellMoments<G>& moments = field.moments[run.cell];
    note<G>(run.first_in_cell ? moments.stress : Working<G>{}, i, scratch.stress_before);
    if (from_particles)
    {
      if (run.first_in_cell)
        moments = {};
      add_moments<G>(model.particles, run.first, run.last, shape, moments);
      add_affine_momentum(model.mesh, model.particles, run.first, run.last, run.cell, moments);
      note<G>(stress_sum<G>(model.particles, run.first, run.last), i, scratch.stress_after);
    }
    else if constexpr (Kind::moves_moments)
      update_moments<G>(model.mesh, model.particles, options, run, i, scratch, moments);
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
  BatchScratch<G::dim> scratch; // not zero: zeros would take a twentieth of the time of a step of few particles
  for (auto& component : scratch.strain)
    std::ranges::fill(component, 0.0);
  for (std::size_t r = 0; r < model.order.runs.size();)
  {
    const Batch batch = next_batch(model.order.runs, r);
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
  if (options.transfer == Transfer::affine)
    find_contents(model);
  if (model.fields.front().integration.kind == Integration::dual_domain)
    pass_batches<StrainPerParticle>(model, options);
  else
    pass_batches<StrainPerCell>(model, options);
  resting_pass(model, options);
  if (options.stress)
    model.energy.stress_work += model.energy.ahead;
  Migration& migration = model.migration;
  if (migration.entered.empty())
    return;
  note_disturbed(model, migration.entered);
  add_entered(model.mesh, model.particles, migration.entered, model.field_of_law, model.fields);
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
