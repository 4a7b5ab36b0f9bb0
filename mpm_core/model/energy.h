#pragma once
/// @file
/// Energy at the particles: what the works of a run must add up to.
///
/// The balance of nodal works says nothing of the stresses: it is an identity. So the work of the stresses is taken at
/// the particles, V sigma : d epsilon by the trapezoidal rule, and compared with what changed their kinetic energy:
///
///     W_ext + W_supports - (K - K_0) - W_stresses - W_damping - W_drag - W_friction - W_pic = unexplained energy.
///
/// A transfer of velocities may take energy out, which W_pic then is; where it has put energy in instead, that counts
/// as unexplained too. The rest comes from particles that cross cells, from averages and integration over cells, whose
/// forces are not those of the particles' stresses, and from the time step.

#include "base/types.h"

namespace mpm::model
{
/// Sums over this rank, except for the largest work [J].
struct EnergyBook
{
  double stress_work = 0;     ///< of the particles' stresses on their strains since the model was made
  double ahead = 0;           ///< part of it that belongs to the half step by which stresses are ahead of velocities
  double pic_loss = 0;        ///< kinetic energy that PIC, or affine transfer, has taken out
  double kinetic = 0;         ///< where particles have gradients, see `affine_kinetic_energy`; in a run at its start
  double outflow_kinetic = 0; ///< of particles that flowed out, and of water that left particles less that it brought
  double outflow_stored = 0;
  double balance_start = 0;  ///< see `energy_balance`, when the particles were last changed by anything but a step
  double kinetic_start = 0;  ///< likewise
  double plastic_start = 0;  ///< stress_work less stored energy, when they were last changed by anything but a step
  double external_start = 0; ///< likewise, external and support work
  double stress_start = 0;   ///< likewise, stress_work
  double pic_start = 0;      ///< likewise, pic_loss
  double largest_work = 0;   ///< of external and support work, or of stress work, since then, over all ranks
  bool stale = true;         ///< the particles have been changed since
};

template <class G, int D>
struct Model;

/// Energies over this rank's particles [J]; where they have gradients, the kinetic one is that of its nodes.
struct ParticleEnergy
{
  double kinetic;
  double stored; ///< by elastic strain; NaN where a law does not say
};

template <class G, int D>
ParticleEnergy particle_energy(const Model<G, D>& model);

/// Energies of one particle.
template <class G, int D>
ParticleEnergy particle_energy(const Model<G, D>& model, Index p);

/// Momentum of one particle, or of all particles that a resting cell stands for [N s].
template <class G, int D>
Vector<G::dim> particle_momentum(const Model<G, D>& model, Index p);

/// Works that came in less those that went out or are stored, at the particles; constant in an exact motion [J].
template <class G, int D>
double energy_balance(const Model<G, D>& model, double kinetic);

/// External and support work, and stress work, since the balance began, of this rank [J].
template <class G, int D>
std::array<double, 2> works_so_far(const Model<G, D>& model);

/// Updates the largest work: waves that leave through absorbing sides take it out again.
/// @note Collective
template <class G, int D>
void note_largest_work(Model<G, D>& model);

/// Resets the balance to the present particles.
template <class G, int D>
void start_energy_balance(Model<G, D>& model);

/// Counts plastic work from the present particles on, whose stresses have not done any.
template <class G, int D>
void start_plastic_work(Model<G, D>& model);
} // namespace mpm::model
