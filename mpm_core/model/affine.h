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

/// Whether particles carry gradients of their velocities, which resting cells have in any run.
template <int D>
inline bool has_affine_gradients(const Particles<D>& particles)
{
  return particles.velocity_gradient.present && !particles.resting.present;
}

/// Gives particles gradients of their velocities, or takes them away. New ones are those of the velocities of the
/// particles in a cell, by least squares; zero where there are too few. Their energy counts as there from the start;
/// that of gradients which are taken away is lost by the transfer.
/// @note Collective
template <class G>
void begin_transfer(Model<G>& model, Transfer transfer);

/// Kinetic energy of particles that carry gradients of their velocities [J], this rank's part: what their nodes can do
/// work with.
///
/// Nodes have the momenta P = M_l v, with lumped masses. Accelerations a change them by M dt a, as the second mapping
/// (19) has it, with the mass matrix M_ij = sum m_p N_i N_j. The work of the forces M_l a is then
/// dt a . M_l v = d(P . M^-1 P / 2), so that energy goes back and forth between this one and that of the stresses, of
/// which that of the particles' own velocities, v . M v / 2, is a part: less than half in waves of four cells.
/// @pre the cells have their moments, and the field its part
/// @note Collective
template <class G>
double affine_kinetic_energy(Model<G>& model);
} // namespace mpm::model
