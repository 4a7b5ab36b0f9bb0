#include "implicit/balance.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
template <class G>
void balance(const VelocityField<G>& field, ImplicitStep<G>& step)
{
  constexpr int D = G::dim;
  step.residual.assign(step.forces.size(), {});
  for (std::size_t i = 0; i < step.residual.size(); ++i)
    for (int a = 0; a < D && step.active[i]; ++a)
    {
      const NodalForces<D>& f = step.forces[i];
      step.residual[i][a] = f.external[a] - f.internal[a] - f.ghost[a] - f.inertia[a];
    }
  for (Support<D> held : field.supports)
  {
    held.value.fill(0);
    impose<D>(held, step.residual[held.node]);
  }
}

/// Where nothing strains a moving body, its forces are round-off of two far larger terms, which cancel: its momentum
/// over the step and its stiffness times its displacement. Where water flows far in a step, its balance is round-off of
/// what the pressures of nodes drive to and fro. The part of these that counts as a force at work: 1e-8 of it, the
/// usual tolerance, is some 50 times the round-off of a number.
constexpr double least_part = 1e-6;

template <class G>
TrialReport trial_report(const NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step,
                         const TrialCount<G::dim>& count)
{
  constexpr int D = G::dim;
  // squares of r, f_ext, f_int, inertia; plastic, failed; water; motion; volumes of water out of balance, and of pores;
  // flow
  std::array<double, 12> sums{};
  const double per_volume = step.pore.flows ? step.pore.unit / step.pore.length : 0;
  sums[11] = least_part * least_part * per_volume * per_volume * step.pore.flow_squares;
  for (std::size_t i = 0; i < step.residual.size(); ++i)
  {
    const NodalForces<D>& f = step.forces[i];
    if (!exchange.owned[i] || !step.active[i])
      continue;
    sums[0] += dot<D>(step.residual[i], step.residual[i]);
    sums[1] += dot<D>(f.external, f.external);
    sums[2] += dot<D>(f.internal, f.internal);
    sums[3] += dot<D>(f.inertia, f.inertia);
    const double per_velocity = least_part * (field.nodes[i].mass / step.dt + step.elastic[i] * step.dt);
    sums[8] += per_velocity * per_velocity * dot<D>(field.velocity[i], field.velocity[i]);
    if (const double water = step.pore.flows ? per_volume * step.pore.content[i] : 0; water != 0)
      sums[step.pore.held[i] ? 7 : 6] += water * water;
    if (step.pore.flows && !step.pore.held[i])
      sums[9] += std::abs(step.pore.content[i]);
  }
  for (const PoreCell<D>& cell : step.pore.cells)
    sums[10] += (1 - cell.grains) * volume_of(cell);
  sums[4] = static_cast<double>(count.plastic);
  sums[5] = static_cast<double>(count.failed);
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, exchange.comm);
  const double scale = std::max({sums[1], sums[2], sums[3], sums[8]});
  // Volumes of water times the unit of pressure over the size of cells count as forces: a volumetric strain weighs as
  // much as its stress, whatever the size of the problem.
  const double water_scale = std::max({scale, sums[7], sums[11]});
  const double residual = water_scale > 0 ? std::max(sums[0], sums[6] * (scale > 0 ? scale / water_scale : 1)) : 0;
  return {std::sqrt(residual), std::sqrt(scale > 0 ? scale : water_scale), sums[10] > 0 ? sums[9] / sums[10] : 0,
          static_cast<std::int64_t>(sums[4]), static_cast<std::int64_t>(sums[5])};
}

#define INSTANTIATE(G)                                                                                                 \
  template void balance(const VelocityField<G>&, ImplicitStep<G>&);                                                    \
  template TrialReport trial_report(const NodeExchange&, const VelocityField<G>&, const ImplicitStep<G>&,              \
                                    const TrialCount<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
