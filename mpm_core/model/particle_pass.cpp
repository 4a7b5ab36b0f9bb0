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

/// What sorting costs per particle, over what a particle out of cell order costs more in a step than one in its place.
constexpr double sort_cost = 0.8;

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

/// Half of the work of a batch's stresses on the strains in the scratch, particle by particle.
template <class G, int D = G::dim>
double half_work(const Particles<D>& particles, const Batch& batch, const BatchScratch<D>& scratch)
{
  double sum = 0;
  for (Index p = batch.first; p < batch.last; ++p)
    for (int k : working_component<G>)
      sum += particles.volume[p] * particles.stress[k][p] * scratch.strain[k][p - batch.first];
  return 0.5 * sum;
}

/// Half of the work of a sum of stresses, V sigma, on the strain of a run of the batch.
template <class G, int D = G::dim>
double half_work(const Working<G>& stress, const BatchScratch<D>& scratch, std::size_t run)
{
  const auto& increment = scratch.cells[run / lanes].increment;
  double sum = 0;
  for (std::size_t k = 0; k < G::n_working; ++k)
    sum += stress[k] * increment[working_component<G>[k]][run % lanes];
  return 0.5 * sum;
}

/// Kinetic energy that PIC takes out of the particles of a run: their own velocities v go towards those of the nodes,
/// v + s (w - v), which costs m s d . (v - s d / 2) with d = v - w.
template <class G, int D = G::dim>
double pic_loss(const Mesh<D>& mesh, const Particles<D>& particles, const VelocityField<G>& field, const Run& run,
                double share)
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
      const double v = particles.velocity[a][p], change = share * (v - w);
      sum += particles.mass[p] * change * (v - 0.5 * change);
    }
  return sum;
}

template <class G, int D = G::dim>
void update_stress(Model<G>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  Particles<D>& particles = model.particles;
  const VelocityField<G>& field = field_of(model, batch.material);
  strain_batch(model.mesh, field, model.order.runs, options, batch, particles, scratch);
  const bool dual = field.integration.kind == Integration::dual_domain;
  if (dual)
    model.energy.stress_work += half_work<G>(particles, batch, scratch);

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
  if (!options.small && !dual)
    give_deformation(
        material_points(model), batch, [&](std::size_t r) { return scratch.motion[r].displacement.gradient; },
        [&](std::size_t r) { return scratch.cells[r / lanes].volumetric[r % lanes]; }, columns, points);
  const BatchReport report = update<D>(model.laws[batch.material], points);
  model.last.plastic += report.plastic;
  if (!report.failed.empty())
    update_failed(model, batch, points, report.failed);
  if (dual)
    model.energy.ahead += half_work<G>(particles, batch, scratch);
}

/// The new cell of a particle that is no longer in its old one; `none` when it is not to be gathered.
template <class G, int D = G::dim>
Index new_cell(Model<G>& model, Index p)
{
  const Mesh<D>& mesh = model.mesh;
  const Location found = find_cell<D>(mesh, at<D>(model.particles.position, p), model.particles.cell[p]);
  if (found.cell == none && found.exit_cell == none)
    note_failure<D>(model.failure, model.particles, Failure<D>::Kind::not_finite, p, {});
  else if (found.cell == none || !is_within_reach(model.exchange, mesh.cell_owners[found.cell]))
    model.migration.lost.push_back(p);
  else if (found.cell < mesh.owned_cells)
    return found.cell;
  else
    model.migration.migrating.push_back({p, mesh.global_cells[found.cell], mesh.cell_owners[found.cell]});
  return none;
}

template <class G, int D = G::dim>
void gather_tractions(const Particles<D>& particles, const CellShape<D>& shape, Index first, Index last, Index cell,
                      VelocityField<G>& field)
{
  if (!field.tractions.empty())
    gather(particles, first, last, shape, field.tractions[cell]);
}

/// Takes out of a cell's moments the particles of a run that have left it, and notes where they went.
template <class G, int D = G::dim>
void follow_leaving(Model<G>& model, const Run& run, VelocityField<G>& field)
{
  const CellShape<D>& shape = model.mesh.shapes[run.cell];
  for (Index p = run.first; p < run.last; ++p)
  {
    const Index cell = new_cell(model, p);
    if (cell == run.cell)
      continue;
    CellMoments<G> moments{};
    gather<G>(model.particles, p, p + 1, shape, moments);
    take_out(moments, field.moments[run.cell]);
    if (!field.tractions.empty())
    {
      TractionMoments<D> tractions{};
      gather(model.particles, p, p + 1, shape, tractions);
      take_out(tractions, field.tractions[run.cell]);
    }
    field.left.push_back(run.cell);
    if (cell == none)
      continue;
    model.particles.cell[p] = cell;
    model.migration.entered.push_back(p);
  }
}

/// What the moments of a cell become when its particles move along with the nodes, whoever they are: only stresses are
/// summed over particles, run by run, and tractions, which are rare.
template <class G, int D = G::dim>
void update_moments(const Particles<D>& particles, const PassOptions& options, const Run& run, std::size_t in_batch,
                    const BatchScratch<D>& scratch, CellMoments<G>& moments, double& ahead)
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
    ahead += half_work<G>(sum, scratch, in_batch);
  }
}

/// Gathers particles that came into cells of this rank, from its own cells or from other ranks.
template <class G, int D = G::dim>
void gather_entered(const Mesh<D>& mesh, const Particles<D>& particles, std::span<const Index> entered, Model<G>& model)
{
  std::vector<std::vector<Index>> cells(model.fields.size());
  for (Index p : entered)
  {
    const Index cell = particles.cell[p], material = particles.material[p];
    VelocityField<G>& field = field_of(model, material);
    gather<G>(particles, p, p + 1, mesh.shapes[cell], field.moments[cell]);
    gather_tractions(particles, mesh.shapes[cell], p, p + 1, cell, field);
    cells[static_cast<std::size_t>(model.field_of_law[static_cast<std::size_t>(material)])].push_back(cell);
  }
  for (std::size_t f = 0; f < cells.size(); ++f)
    add_cells<D>(mesh, cells[f], model.fields[f].part);
}

/// Whether the moments of all cells are gathered from the particles in this pass, and not moved along. The particles of
/// a dual domain grow each in its own way, so that their volumes do not follow from the cell's strain.
template <class G>
bool gathers_all(const Model<G>& model)
{
  return model.fields.front().integration.kind == Integration::dual_domain ||
         model.totals.steps % gathering_interval == 0;
}

/// Moves and strains the particles of a batch, and brings the moments of their cells to where they are then.
template <class G, int D = G::dim>
void pass_batch(Model<G>& model, const PassOptions& options, const Batch& batch, bool gather_all,
                BatchScratch<D>& scratch)
{
  VelocityField<G>& field = field_of(model, batch.material);
  auto& runs = model.order.runs;
  const bool dual = field.integration.kind == Integration::dual_domain;
  find_motions(model.mesh, field, runs, options, batch, scratch);
  for (std::size_t r = batch.first_run; options.move && options.pic_share > 0 && r < batch.last_run; ++r)
    model.energy.pic_loss += pic_loss(model.mesh, model.particles, field, runs[r], options.pic_share);
  if (options.move)
    for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
      runs[r].scattered = !move_particles<D>(model.particles, runs[r].first, runs[r].last,
                                             model.mesh.shapes[runs[r].cell], scratch.motion[r - batch.first_run]);
  if (options.stress)
    update_stress(model, options, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = runs[r];
    const CellShape<D>& shape = model.mesh.shapes[run.cell];
    const std::size_t i = r - batch.first_run;
    CellMoments<G>& moments = field.moments[run.cell];
    if (run.first_in_cell && options.stress && !dual)
      model.energy.stress_work += half_work<G>(moments.stress, scratch, i);
    if (gather_all)
    {
      if (run.first_in_cell)
        moments = {};
      gather<G>(model.particles, run.first, run.last, shape, moments);
      if (options.stress && !dual)
        model.energy.ahead += half_work<G>(stress_sum<G>(model.particles, run.first, run.last), scratch, i);
    }
    else
      update_moments<G>(model.particles, options, run, i, scratch, moments, model.energy.ahead);
    gather_tractions(model.particles, shape, run.first, run.last, run.cell, field);
    if (run.scattered)
      follow_leaving(model, run, field);
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
  const bool gather_all = gathers_all(model);
  BatchScratch<G::dim> scratch{};
  for (std::size_t r = 0; r < model.order.runs.size();)
  {
    const Batch batch = next_batch(model.order.runs, r);
    pass_batch(model, options, batch, gather_all, scratch);
    r = batch.last_run;
  }
  if (options.stress)
    model.energy.stress_work += model.energy.ahead;
  Migration& migration = model.migration;
  if (migration.entered.empty())
    return;
  gather_entered(model.mesh, model.particles, migration.entered, model);
  model.order.out_of_order += static_cast<Index>(migration.entered.size());
  migration.entered.clear();
  if (migration.migrating.empty() && migration.lost.empty())
    find_cell_runs(model, true);
}

template <class G>
void migrate_particles(Model<G>& model)
{
  Migration& migration = model.migration;
  const bool gone = !migration.migrating.empty() || !migration.outflow.empty();
  for (Index p : migration.outflow)
  {
    const ParticleEnergy energy = particle_energy(model, p);
    model.totals.outflow_mass += model.particles.mass[p];
    model.energy.outflow_kinetic += energy.kinetic;
    model.energy.outflow_stored += energy.stored;
  }
  model.totals.outflow_particles += static_cast<std::int64_t>(migration.outflow.size());
  const Index arrived = migrate(migration.owned_cells, model.exchange,
                                {migration.migrating, migration.outflow, migration.far_partners}, model.particles);
  migration.migrating.clear();
  migration.outflow.clear();
  migration.far_partners.clear();
  std::vector<Index> arrivals(static_cast<std::size_t>(arrived));
  std::iota(arrivals.begin(), arrivals.end(), model.particles.size() - arrived);
  gather_entered<G>(model.mesh, model.particles, arrivals, model);

  // Particles out of order cut the runs of two cells. Sorting is due when they have cost as much as it does.
  CellOrder& order = model.order;
  order.out_of_order += arrived;
  order.cost += order.out_of_order;
  if (static_cast<double>(order.cost) > sort_cost * model.particles.size())
    sort_particles(model);
  else if (gone || arrived > 0)
    find_cell_runs(model, false);
}

#define INSTANTIATE(G)                                                                                                 \
  template void particle_pass(Model<G>&, const PassOptions&);                                                          \
  template void migrate_particles(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm
