#pragma once
/// @file
/// Which velocities particles carry from step to step: FLIP, or affine transfer (transfer/affine_momentum.h).

#include "model/model.h"

namespace mpm::model
{
/// Velocities of particles from those of the nodes.
enum class Transfer
{
  flip,  ///< their own, which take the change of the nodes' velocities (18), with PIC a part of these velocities
  affine ///< that of the nodes at their place, and its gradient (APIC, the same as TPIC in linear simplices)
};

/// Gives particles gradients of their velocities, or takes them away. New ones are those of the velocities of the
/// particles in a cell, by least squares; zero where there are too few.
/// @note Collective
template <class G>
void begin_transfer(Model<G>& model, Transfer transfer);

/// Kinetic energy of the particles of this rank, without that of their gradients [J].
template <int D>
double kinetic_energy(const Particles<D>& particles, Index first, Index last)
{
  double sum = 0;
  for (int a = 0; a < D; ++a)
    for (Index p = first; p < last; ++p)
      sum += particles.mass[p] * particles.velocity[a][p] * particles.velocity[a][p];
  return 0.5 * sum;
}
} // namespace mpm::model
