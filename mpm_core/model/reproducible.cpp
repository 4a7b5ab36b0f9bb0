#include "model/reproducible.h"

#include "parallel/rounded_sums.h"

namespace mpm::model
{
namespace
{
/// Number of runs in each cell.
template <class G>
std::vector<Index> runs_per_cell(const Model<G>& model)
{
  std::vector<Index> counts(static_cast<std::size_t>(model.mesh.owned_cells));
  for (const Run& run : model.order.runs)
    ++counts[static_cast<std::size_t>(run.cell)];
  return counts;
}

/// Sums the tractions in the cells, of which there are few.
template <class G, int D = G::dim>
void sum_rounded_tractions(Model<G>& model)
{
  const Particles<D>& particles = model.particles;
  for (VelocityField<G>& field : model.fields)
  {
    std::vector<TractionMoments<D>> largest(field.tractions.size());
    for (Index c : field.part.cells)
      field.tractions[c] = {};
    const auto each_particle = [&](auto&& work)
    {
      for (const Run& run : model.order.runs)
        for (Index p = run.first; p < run.last && &field_of(model, run.material) == &field; ++p)
        {
          TractionMoments<D> own{};
          add_moments(particles, p, p + 1, model.mesh.shapes[run.cell], own);
          work(run.cell, own);
        }
    };
    each_particle([&](Index c, const TractionMoments<D>& own)
                  { keep_largest(own, largest[static_cast<std::size_t>(c)]); });
    each_particle([&](Index c, const TractionMoments<D>& own)
                  { add_rounded(own, largest[static_cast<std::size_t>(c)], field.tractions[c]); });
  }
}
} // namespace

template <class G>
void sum_rounded_moments(Model<G>& model)
{
  // Most cells have one run, whose largest terms are known at once; particles out of order make more of them.
  const std::vector<Index> counts = runs_per_cell(model);
  const auto is_alone = [&](const Run& run) { return counts[static_cast<std::size_t>(run.cell)] == 1; };
  const auto keep = [&](const Run& run, CellMoments<G>& largest)
  { keep_largest_terms<G>(model.particles, run.first, run.last, model.mesh.shapes[run.cell], largest); };
  std::vector<std::vector<CellMoments<G>>> largest(model.fields.size());
  const auto largest_of = [&](const Run& run) -> CellMoments<G>&
  {
    auto& of_field = largest[static_cast<std::size_t>(model.field_of_law[static_cast<std::size_t>(run.material)])];
    of_field.resize(static_cast<std::size_t>(model.mesh.owned_cells));
    return of_field[static_cast<std::size_t>(run.cell)];
  };
  for (const Run& run : model.order.runs)
    if (!is_alone(run))
      keep(run, largest_of(run));
  for (VelocityField<G>& field : model.fields)
    for (Index c : field.part.cells)
      field.moments[c] = {};
  for (const Run& run : model.order.runs)
  {
    CellMoments<G> bound{};
    if (is_alone(run))
      keep(run, bound);
    else
      bound = largest_of(run);
    add_rounded_moments<G>(model.particles, run.first, run.last, model.mesh.shapes[run.cell], bound,
                           field_of(model, run.material).moments[run.cell]);
  }
  if (model.particles.traction.present)
    sum_rounded_tractions(model);
}

#define INSTANTIATE(G) template void sum_rounded_moments(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
