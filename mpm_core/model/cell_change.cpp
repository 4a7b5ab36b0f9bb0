#include "model/cell_change.h"

#include "mesh/search.h"
#include "model/resting.h"
#include "model/resting_nodes.h"
#include "transfer/affine_momentum.h"

#include <numeric>

namespace mpm::model
{
namespace
{
/// What sorting costs per particle, over what a particle out of cell order costs more in a step than one in its place.
constexpr double sort_cost = 0.8;

/// The new cell of a particle that is no longer in its old one; `none` when it is not to be added to moments.
template <int D>
Index new_cell(const Mesh<D>& mesh, const NodeExchange& exchange, const Particles<D>& particles, Index p,
               Migration& migration, std::optional<Failure<D>>& failure)
{
  const Location found = find_cell<D>(mesh, at<D>(particles.position, p), particles.cell[p]);
  if (found.cell == none && found.exit_cell == none)
    note_failure<D>(failure, particles, Failure<D>::Kind::not_finite, p, {});
  else if (found.cell == none || !is_within_reach(exchange, mesh.cell_owners[found.cell]))
    migration.lost.push_back(p);
  else if (found.cell < mesh.owned_cells)
    return found.cell;
  else
    migration.migrating.push_back({p, mesh.global_cells[found.cell], mesh.cell_owners[found.cell]});
  return none;
}
} // namespace

template <class G>
void follow_leaving(Model<G>& model, const Run& run, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  const CellShape<D>& shape = model.mesh.shapes[run.cell];
  for (Index p = run.first; p < run.last; ++p)
  {
    const Index cell = new_cell(model.mesh, model.exchange, model.particles, p, model.migration, model.failure);
    if (cell == run.cell)
      continue;
    CellMoments<G> moments{};
    add_moments<G>(model.particles, p, p + 1, shape, moments);
    add_affine_momentum(model.mesh, model.particles, p, p + 1, run.cell, moments);
    take_out(moments, field.moments[run.cell]);
    if (!field.tractions.empty())
    {
      TractionMoments<D> tractions{};
      add_moments(model.particles, p, p + 1, shape, tractions);
      take_out(tractions, field.tractions[run.cell]);
    }
    field.left.push_back(run.cell);
    if (cell == none)
      continue;
    model.particles.cell[p] = cell;
    model.migration.entered.push_back(p);
  }
}

template <class G, int D>
void add_entered(const Mesh<D>& mesh, const Particles<D>& particles, std::span<const Index> entered,
                 std::span<const Index> field_of_law, std::vector<VelocityField<G>>& fields)
{
  std::vector<std::vector<Index>> cells(fields.size());
  for (Index p : entered)
  {
    const Index cell = particles.cell[p], material = particles.material[p];
    const auto number = static_cast<std::size_t>(field_of_law[static_cast<std::size_t>(material)]);
    VelocityField<G>& field = fields[number];
    add_moments<G>(particles, p, p + 1, mesh.shapes[cell], field.moments[cell]);
    add_affine_momentum(mesh, particles, p, p + 1, cell, field.moments[cell]);
    add_tractions(particles, mesh.shapes[cell], p, p + 1, cell, field);
    cells[number].push_back(cell);
  }
  for (std::size_t f = 0; f < cells.size(); ++f)
    add_cells<D>(mesh, cells[f], fields[f].part);
}

template <class G>
void note_disturbed(Model<G>& model, std::span<const Index> entered)
{
  const auto& marks = model.fields.front().resting.marks;
  for (Index p : entered)
    if (const Index cell = model.particles.cell[p]; !marks.empty() && marks[static_cast<std::size_t>(cell)])
      model.migration.disturbed.push_back(cell);
  if (!model.migration.disturbed.empty())
    update_resting_rows(model);
}

namespace
{
/// Resting cells that particles have entered become particles, too.
template <class G>
void convert_disturbed(Model<G>& model)
{
  std::vector<unsigned char> chosen(static_cast<std::size_t>(model.mesh.owned_cells), 0);
  for (Index cell : model.migration.disturbed)
    chosen[static_cast<std::size_t>(cell)] = 1;
  model.migration.disturbed.clear();
  convert_cells<G>(model, chosen);
}
} // namespace

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
    model.energy.kinetic -= energy.kinetic;
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
  note_disturbed(model, arrivals);
  add_entered(model.mesh, model.particles, arrivals, model.field_of_law, model.fields);

  // Particles out of order cut the runs of two cells. Sorting is due when they have cost as much as it does.
  CellOrder& order = model.order;
  order.out_of_order += arrived;
  order.cost += order.out_of_order;
  if (!migration.disturbed.empty())
    convert_disturbed(model);
  else if (static_cast<double>(order.cost) > sort_cost * model.particles.size())
    sort_particles(model);
  else if (gone || arrived > 0)
    find_cell_runs(model, false);
}

#define INSTANTIATE(G)                                                                                                 \
  template void follow_leaving(Model<G>&, const Run&, VelocityField<G>&);                                              \
  template void add_entered(const Mesh<G::dim>&, const Particles<G::dim>&, std::span<const Index>,                     \
                            std::span<const Index>, std::vector<VelocityField<G>>&);                                   \
  template void note_disturbed(Model<G>&, std::span<const Index>);                                                     \
  template void migrate_particles(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
