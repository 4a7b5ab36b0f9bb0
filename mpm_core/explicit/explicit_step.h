#pragma once
/// @file
/// The explicit scheme, section 3 of the paper.

#include "model/affine.h"
#include "model/material_points.h"
#include "model/rayleigh.h"

namespace mpm::explicit_scheme
{
/// When stresses are updated, and with which velocities.
enum class StressUpdate
{
  modified_last, ///< MUSL: last, with velocities mapped back from the moved particles (19)
  last, ///< USL: last, with v_i + dt a_i; needs a smaller step where nodes carry little mass, f_int / m_i being large
  first ///< USF: before the momentum equation, with the velocities at the step's start
};

struct ExplicitOptions
{
  StressUpdate stress_update = StressUpdate::modified_last;
  double damping = 0;      ///< local damping alpha of FLAC, in [0, 1)
  Rayleigh rayleigh;       ///< damping at small strains
  double pic_fraction = 0; ///< of a step, in [0, 1]
  Transfer transfer = Transfer::flip;
  bool moving_cells = false; ///< cells with particles move with them
  bool nmd = false;          ///< nodal mixed discretisation
  Integration integration = Integration::particles;
  bool has_dashpots = false;    ///< some rank has absorbing sides
  bool renews_dashpots = false; ///< finds anew what they know of the particles beside them, see `prepare_dashpots`
  bool reproducible = false;    ///< particles are the same to the last bit on any number of ranks
};

/// Whether the mean stresses of nodal forces are averaged over nodes (nodal mixed discretisation), and by what
/// fraction.
enum class Averages
{
  none,
  of_steps,   ///< in each soil by the fraction by which its strains are: forces and strains are conjugate
  as_elements ///< as finite elements: strains in full, forces by less in soil that dilates less than associated flow;
              ///< with water as `of_steps`
};

/// Chooses how steps make nodal forces of the particles' stresses, and find strains, from here on.
template <class G>
void choose_forces(Model<G>& model, Integration kind, Averages averages);

/// One explicit step (16)-(20) of length dt [s]. Moves particles, updates their stresses, adds to the model's totals.
/// @pre prepare(model) has been called
/// @post model.failure is set on every rank when it is on any; the step is then not whole
/// @note Collective
template <class G>
void explicit_step(Model<G>& model, const ExplicitOptions& options, double dt);

/// |f_ext - f_int| / |f_ext| at the nodes of all fields under this gravity [m/s2], for the sums as they were mapped
/// last; supported directions do not count above. Without external force, as under prescribed velocities, reactions
/// take its place; 0 without either.
/// @note Collective
template <class G>
double out_of_balance(const Model<G>& model, const Vector<G::dim>& gravity);

/// The PIC fraction of a step of dt [s] under which the particles' own velocities fade as fast in time whatever the
/// step: 1 - (1 - fraction)^(dt / dt_cr).
/// @param fraction  of a critical time step, in [0, 1]
double pic_fraction_of_step(double fraction, double dt, double critical);
} // namespace mpm::explicit_scheme
