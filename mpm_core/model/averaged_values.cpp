#include "model/averaged_values.h"

#include "model/integration.h"

namespace mpm::model
{
namespace
{
/// A run for each particle that moves with a field, in the order of the particles, which need not be sorted.
template <class G>
std::vector<Run> runs_of_field(const Model<G>& model, const VelocityField<G>& field)
{
  std::vector<Run> runs;
  for (Index p = 0; p < model.particles.size(); ++p)
    if (&field_of(model, model.particles.material[p]) == &field)
      runs.push_back({p, p + 1, model.particles.cell[p], model.particles.material[p]});
  return runs;
}
} // namespace

template <class G>
std::vector<double> averaged_over_nodes(Model<G>& model, std::span<const double> values)
{
  constexpr int D = G::dim;
  const Mesh<D>& mesh = model.mesh;
  std::vector<double> averaged(values.size());
  std::vector<VolumeMean> cells, means;
  for (const VelocityField<G>& field : model.fields)
  {
    const std::vector<Run> runs = runs_of_field(model, field);
    cells.assign(static_cast<std::size_t>(mesh.owned_cells), {});
    std::vector<Index> filled;
    for (const Run& run : runs)
    {
      if (cells[run.cell].volume == 0)
        filled.push_back(run.cell);
      cells[run.cell].value += model.particles.volume[run.first] * values[run.first];
      cells[run.cell].volume += model.particles.volume[run.first];
    }
    const MeshPart part = make_part<D>(mesh, filled, model.exchange.shared_nodes);
    const AveragedGroups groups =
        averaged_groups(mesh, {runs}, field.integration.group_by_law, field.integration.n_groups);
    average_over_nodes(
        mesh, part, groups, [&](Index c) { return cells[c].volume; }, [&](Index c, double) { return cells[c].value; },
        model.exchange, means);
    for (const Run& run : runs)
      averaged[run.first] = mean_of_vertices<D>(mesh, groups, run.cell, means);
  }
  return averaged;
}

#define INSTANTIATE(G) template std::vector<double> averaged_over_nodes(Model<G>&, std::span<const double>);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
