#include "model/integration.h"

#include "materials/laws/stiffness_groups.h"
#include "model/mapping.h"
#include "transfer/affine_field.h"

#include <algorithm>

namespace mpm::model
{
namespace
{
/// Finds the cells that are full, or whose nodes all are among full ones.
template <class G, int D = G::dim>
void find_whole_cells(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field)
{
  auto& fills = field.integration.fills;
  auto& whole = field.integration.whole;
  const auto fill = [&](Index c) // its particles' volume, its own
  {
    return std::array<double, 2>{field.moments[c].volume, cell_volume<G>(mesh.shapes[c])};
  };
  fills.assign(mesh.points.size(), {0.0, 0.0});
  whole.resize(static_cast<std::size_t>(mesh.owned_cells));
  const auto each_term = [&](auto&& add)
  {
    for (Index c = 0; c < mesh.owned_cells; ++c)
      for (Index node : mesh.cells[c])
        add(node, fill(c));
  };
  using Fill = std::array<double, 2>;
  sum_at_nodes<Fill>(
      exchange, [&fills](Index node) -> Fill& { return fills[node]; }, each_term);
  sum_shared(exchange, fills);
  const auto is_full = [](const std::array<double, 2>& f, double fraction) { return f[0] >= fraction * f[1]; };
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    const bool among_full =
        std::ranges::all_of(mesh.cells[c], [&](Index node) { return is_full(fills[node], full_fraction_around); });
    whole[c] = field.moments[c].mass > 0 && (among_full || is_full(fill(c), full_fraction));
  }
}

/// Sums for the mean stresses of the dual domains, over all ranks.
template <class G, int D = G::dim>
void map_dual_domains(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                      const std::vector<Run>& runs, CellIntegration<D>& integration)
{
  integration.dual_cells.assign(static_cast<std::size_t>(mesh.owned_cells), {});
  integration.dual_nodes.assign(mesh.points.size(), {});
  for (const Run& run : runs)
  {
    if (!integration.whole[run.cell])
      continue;
    std::array<DualStress<D>*, D + 1> nodes;
    for (int k = 0; k <= D; ++k)
      nodes[k] = &integration.dual_nodes[mesh.cells[run.cell][k]];
    add_dual_stress<D>(particles, run.first, run.last, mesh.shapes[run.cell], integration.dual_cells[run.cell], nodes);
  }
  sum_shared(exchange, integration.dual_nodes);
}

template <class G>
Working<G> scaled_stress(Working<G> stress, double factor)
{
  for (double& component : stress)
    component *= factor;
  return stress;
}

/// The mean stress of a full cell by dual domains.
template <int D>
std::array<double, n_symmetric<D>> dual_stress(const Mesh<D>& mesh, const CellIntegration<D>& integration, Index cell)
{
  std::array<const DualStress<D>*, D + 1> nodes;
  for (int k = 0; k <= D; ++k)
    nodes[k] = &integration.dual_nodes[mesh.cells[cell][k]];
  return dual_mean<D>(integration.dual_cells[cell], nodes);
}
} // namespace

template <class G, int D>
Working<G> full_cell_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  const double volume = cell_volume<G>(mesh.shapes[cell]);
  if constexpr (!G::has_hoop)
    if (field.integration.kind == Integration::dual_domain)
      return scaled_stress<G>(dual_stress<D>(mesh, field.integration, cell), volume);
  return scaled_stress<G>(field.moments[cell].stress, volume / field.moments[cell].volume);
}

template <class G>
void group_soils(Model<G>& model)
{
  for (std::size_t f = 0; f < model.fields.size(); ++f)
  {
    CellIntegration<G::dim>& integration = model.fields[f].integration;
    integration.group_by_law.assign(model.laws.size(), -1);
    std::vector<std::size_t> numbers;
    std::vector<Law> laws;
    for (std::size_t law = 0; law < model.laws.size(); ++law)
      if (static_cast<std::size_t>(model.field_of_law[law]) == f)
      {
        numbers.push_back(law);
        laws.push_back(model.laws[law]);
      }
    const std::vector<int> groups = materials::stiffness_groups(laws);
    for (std::size_t k = 0; k < groups.size(); ++k)
      integration.group_by_law[numbers[k]] = groups[k];
    integration.n_groups = *std::ranges::max_element(groups) + 1; // each field has a law
  }
}

template <int D>
AveragedGroups averaged_groups(const Mesh<D>& mesh, std::initializer_list<std::span<const Run>> runs,
                               const std::vector<int>& group_by_law, int count)
{
  AveragedGroups groups{count, {}};
  if (count == 1)
    return groups;
  groups.of_cell.assign(static_cast<std::size_t>(mesh.owned_cells), none);
  std::vector<Index> mixed; // cells of several groups, which are few
  const auto for_each_run = [&](auto&& work)
  {
    for (const std::span<const Run> each : runs)
      for (const Run& run : each)
        if (const int group = group_by_law[run.material]; group >= 0)
          work(run, group);
  };
  for_each_run(
      [&](const Run& run, int group)
      {
        Index& of_cell = groups.of_cell[run.cell];
        if (of_cell != none && of_cell != group)
          mixed.push_back(run.cell);
        of_cell = group;
      });
  for (Index& of_cell : groups.of_cell)
    of_cell = std::max(of_cell, 0); // of empty cells
  if (mixed.empty())
    return groups;
  std::ranges::sort(mixed);
  const auto repeated = std::ranges::unique(mixed);
  mixed.erase(repeated.begin(), repeated.end());
  std::vector<Index> particles(mixed.size() * static_cast<std::size_t>(count));
  for_each_run(
      [&](const Run& run, int group)
      {
        const auto place = std::ranges::lower_bound(mixed, run.cell);
        if (place != mixed.end() && *place == run.cell)
          particles[static_cast<std::size_t>((place - mixed.begin()) * count + group)] += run.last - run.first;
      });
  for (std::size_t k = 0; k < mixed.size(); ++k)
  {
    const auto first = particles.begin() + static_cast<std::ptrdiff_t>(k) * count;
    groups.of_cell[mixed[k]] = static_cast<Index>(std::max_element(first, first + count) - first);
  }
  return groups;
}

template <class G, int D>
void begin_integration(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                       const std::vector<Run>& runs, VelocityField<G>& field)
{
  if (field.integration.kind == Integration::particles)
    return;
  find_whole_cells(mesh, exchange, field);
  if constexpr (!G::has_hoop)
    if (field.integration.kind == Integration::dual_domain)
      map_dual_domains<G>(mesh, exchange, particles, runs, field.integration);
}

template <class G, int D>
void average_gradients(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field)
{
  auto& means = field.integration.mean_gradients;
  means.assign(mesh.points.size(), {});
  const auto velocity = [&](Index i) -> const Vector<D>& { return field.velocity[i]; };
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    if (!field.integration.whole[c])
      continue;
    const double volume = cell_volume<G>(mesh.shapes[c]);
    const Matrix<D> gradient = affine_field<D>(mesh, c, velocity).gradient;
    for (Index node : mesh.cells[c])
    {
      means[node].volume += volume;
      for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b)
          means[node].gradient[a][b] += volume * gradient[a][b];
    }
  }
  sum_shared(exchange, means);
  for (MeanGradient<D>& node : means)
    for (auto& row : node.gradient)
      for (double& component : row)
        component /= node.volume > 0 ? node.volume : 1;
}

template <class G>
Matrix<G::dim> dual_gradient(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const Vector<G::dim>& position,
                             Index cell)
{
  constexpr int D = G::dim;
  const DualWeights<D> weights = dual_weights<D>(mesh.shapes[cell], position);
  const auto velocity = [&](int k) { return value_of_vertex(mesh, field, field.velocity, cell, k); };
  Matrix<D> gradient = affine_field_of_vertices<D>(mesh.shapes[cell], velocity).gradient;
  if (!field.integration.whole[cell])
    return gradient;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
    {
      gradient[a][b] *= weights.cell;
      for (int k = 0; k <= D; ++k)
        gradient[a][b] += weights.node[k] * field.integration.mean_gradients[mesh.cells[cell][k]].gradient[a][b];
    }
  return gradient;
}

#define INSTANTIATE(G)                                                                                                 \
  template Working<G> full_cell_stress(const Mesh<G::dim>&, const VelocityField<G>&, Index);                           \
  template void group_soils(Model<G>&);                                                                                \
  template void begin_integration(const Mesh<G::dim>&, NodeExchange&, const Particles<G::dim>&,                        \
                                  const std::vector<Run>&, VelocityField<G>&);                                         \
  template void average_gradients(const Mesh<G::dim>&, NodeExchange&, VelocityField<G>&);                              \
  template Matrix<G::dim> dual_gradient(const Mesh<G::dim>&, const VelocityField<G>&, const Vector<G::dim>&, Index);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
#undef INSTANTIATE
#define INSTANTIATE(D)                                                                                                 \
  template AveragedGroups averaged_groups(const Mesh<D>&, std::initializer_list<std::span<const Run>>,                 \
                                          const std::vector<int>&, int);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::model
