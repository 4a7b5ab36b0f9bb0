#include "model/integration.h"

#include "transfer/affine_field.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// Finds the cells that are full, or whose nodes all are among full ones.
template <int D>
void find_whole_cells(Model<D>& model)
{
  Workspace<D>& work = model.work;
  const auto fill = [&](Index c) // its particles' volume, its own
  {
    return std::array<double, 2>{work.moments[c].volume, model.mesh.shapes[c].volume};
  };
  work.fills.assign(model.mesh.points.size(), {0.0, 0.0});
  work.whole.resize(static_cast<std::size_t>(model.mesh.owned_cells));
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    for (Index node : model.mesh.cells[c])
      for (std::size_t k = 0; k < 2; ++k)
        work.fills[node][k] += fill(c)[k];
  sum_shared(model.exchange, work.fills);
  const auto is_full = [](const std::array<double, 2>& f, double share) { return f[0] >= share * f[1]; };
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    const auto& nodes = model.mesh.cells[c];
    const bool among_full = std::all_of(nodes.begin(), nodes.end(),
                                        [&](Index node) { return is_full(work.fills[node], full_share_around); });
    work.whole[c] = work.moments[c].mass > 0 && (among_full || is_full(fill(c), full_share));
  }
}

/// Sums for the mean stresses of the dual domains, over all ranks.
template <int D>
void gather_dual_domains(Model<D>& model)
{
  Workspace<D>& work = model.work;
  work.dual_cells.assign(static_cast<std::size_t>(model.mesh.owned_cells), {});
  work.dual_nodes.assign(model.mesh.points.size(), {});
  for (const Run& run : work.runs)
  {
    if (!work.whole[run.cell])
      continue;
    std::array<DualStress<D>*, D + 1> nodes;
    for (int k = 0; k <= D; ++k)
      nodes[k] = &work.dual_nodes[model.mesh.cells[run.cell][k]];
    gather_dual<D>(model.particles, run.first, run.last, model.mesh.shapes[run.cell], work.dual_cells[run.cell], nodes);
  }
  sum_shared(model.exchange, work.dual_nodes);
}

/// What a cell integrates: volume times mean stress.
template <int D>
std::array<double, n_symmetric<D>> integrated_stress(const Model<D>& model, Index cell)
{
  const Workspace<D>& work = model.work;
  std::array<double, n_symmetric<D>> stress = work.moments[cell].stress;
  if (!work.whole[cell])
    return stress;
  double factor = model.mesh.shapes[cell].volume / work.moments[cell].volume;
  if (model.integration == Integration::dual_domain)
  {
    std::array<const DualStress<D>*, D + 1> nodes;
    for (int k = 0; k <= D; ++k)
      nodes[k] = &work.dual_nodes[model.mesh.cells[cell][k]];
    stress = dual_mean<D>(work.dual_cells[cell], nodes);
    factor = model.mesh.shapes[cell].volume;
  }
  for (double& component : stress)
    component *= factor;
  return stress;
}
} // namespace

template <int D>
void integrate_stress(Model<D>& model)
{
  Workspace<D>& work = model.work;
  find_whole_cells(model);
  if (model.integration == Integration::dual_domain)
    gather_dual_domains(model);
  for (NodeSums<D>& node : work.nodes)
    node.internal = {};
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    if (work.moments[c].mass == 0)
      continue;
    const auto stress = integrated_stress(model, c);
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> force = internal_force<D>(stress, model.mesh.shapes[c].gradient[k]);
      for (int a = 0; a < D; ++a)
        work.nodes[model.mesh.cells[c][k]].internal[a] += force[a];
    }
  }
}

template <int D>
void average_gradients(Model<D>& model)
{
  Workspace<D>& work = model.work;
  work.mean_gradients.assign(model.mesh.points.size(), {});
  const auto velocity = [&](Index i) -> const Vector<D>& { return work.velocity[i]; };
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
  {
    if (!work.whole[c])
      continue;
    const double volume = model.mesh.shapes[c].volume;
    const Matrix<D> gradient = affine_field<D>(model.mesh, c, velocity).gradient;
    for (Index node : model.mesh.cells[c])
    {
      work.mean_gradients[node].volume += volume;
      for (int a = 0; a < D; ++a)
        for (int b = 0; b < D; ++b)
          work.mean_gradients[node].gradient[a][b] += volume * gradient[a][b];
    }
  }
  sum_shared(model.exchange, work.mean_gradients);
  for (MeanGradient<D>& node : work.mean_gradients)
    for (auto& row : node.gradient)
      for (double& component : row)
        component /= node.volume > 0 ? node.volume : 1;
}

template <int D>
Matrix<D> dual_gradient(const Model<D>& model, Index particle, Index cell)
{
  const auto velocity = [&](Index i) -> const Vector<D>& { return model.work.velocity[i]; };
  const DualWeights<D> weights = dual_weights<D>(model.mesh.shapes[cell], at<D>(model.particles.position, particle));
  Matrix<D> gradient = affine_field<D>(model.mesh, cell, velocity).gradient;
  if (!model.work.whole[cell])
    return gradient;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
    {
      gradient[a][b] *= weights.cell;
      for (int k = 0; k <= D; ++k)
        gradient[a][b] += weights.node[k] * model.work.mean_gradients[model.mesh.cells[cell][k]].gradient[a][b];
    }
  return gradient;
}

#define INSTANTIATE(D)                                                                                                 \
  template void integrate_stress(Model<D>&);                                                                           \
  template void average_gradients(Model<D>&);                                                                          \
  template Matrix<D> dual_gradient<D>(const Model<D>&, Index, Index);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
