#pragma once
/// @file
/// Contact of particles with a rigid surface: a penalty on the gap, with Coulomb friction.
///
/// The gap of a particle is its distance from the surface less its radius r_p = V_p^(1/D) / 2. With the velocity v of
/// the nodes at its place, relative to the surface, the force on it is
///
///     f = kappa <-(g + dt v_n)> n - kappa s,   kappa = beta m_p / dt_c^2,   |kappa s| <= mu f_n
///
/// with the elastic slip s, to which dt v_t is added before it is returned to the cone of friction. Since
/// sum kappa_p N_i N_j <= beta / dt_c^2 M_ij and M_ij is below the lumped masses, contact has no frequency above
/// sqrt(beta) / dt_c, whatever the soil and the mesh; and with the gap and the slip at the end of the step, the nodes
/// never get more work from it than its springs give up, as long as beta dt^2 <= dt_c^2 (docs/contact.md).

#include "contact/motion.h"
#include "contact/surfaces.h"
#include "mesh/mesh.h"
#include "particles/particles.h"

namespace mpm::contact
{
/// A rigid surface that touches the particles, what it feels, and what it remembers.
template <int D>
struct Contact
{
  Surface<D> surface; ///< where it is at the time `start`
  double friction;    ///< coefficient mu of Coulomb
  double penalty;     ///< beta, in (0, 1]
  Motion<D> motion;
  double start;          ///< time at which the motion begins [s]
  Vector<D> reference;   ///< point about which moments count, at `start`; it moves along [m]
  std::string slip;      ///< name of the particles' field with their elastic slip; empty without friction
  double stiff_step = 0; ///< dt_c [s]; 0 before the first step

  // Of the soil on the surface in the last step, and since it was made; this rank's part
  Vector<D> force{};   ///< [N]
  Vector<3> moment{};  ///< [N m]
  Vector<D> impulse{}; ///< [N s]

  // Lower bounds of the gaps in each cell, found when the surface was displaced by `found_at`
  std::vector<double> clearance;
  Vector<D> found_at{};
  double cell_size = 0; ///< displacement after which they are found again [m]
};

/// Half the side of a square or cube as large as a particle [m].
template <class G>
double particle_radius(const Particles<G::dim>& particles, Index p);

/// A step of a run.
struct TimeStep
{
  double start; ///< [s]
  double dt;    ///< [s]; 0 for the forces as they are
};

/// Begins a step: no force yet, the stiffness, and bounds of the gaps.
template <int D>
void begin_step(const Mesh<D>& mesh, const TimeStep& step, Contact<D>& contact);

/// The particles that move with one velocity field.
struct Movers
{
  std::span<const Index> field_of_law;
  Index field;
};

/// Adds the forces on particles to their nodes, and to what the surface feels.
/// @param velocity  of the nodes at the step's start [m/s]
/// @returns whether any particle was in contact
template <class G, int D = G::dim>
bool add_contact_forces(const Mesh<D>& mesh, const std::vector<Run>& runs, const Movers& movers,
                        std::span<const Vector<D>> velocity, const TimeStep& step, Particles<D>& particles,
                        Contact<D>& contact, std::span<Vector<D>> forces);

/// The smallest gap of this rank's particles; infinite without any [m].
template <class G, int D = G::dim>
double smallest_gap(const Particles<D>& particles, const Surface<D>& surface);
} // namespace mpm::contact
