#pragma once
/// @file
/// The end of every explicit step: nodes to particles.

#include "explicit/explicit_step.h"
#include "model/cell_change.h"
#include "model/moving_cells.h"
#include "model/particle_pass.h"

namespace mpm::explicit_scheme
{
/// Nodes to particles: v_p += dt sum N_i a_i (18), x_p += dt sum N_i v_i (20), and with `stress` strains, stresses and
/// volumes, in one pass that also takes the cells' moments along; then the mesh is reset under the particles, or moves
/// with them.
/// @note Collective
template <class G>
void update_particles(Model<G>& model, const ExplicitOptions& options, double dt, bool stress, PhaseClock& clock)
{
  clock.begin(Phase::particles);
  particle_pass(
      model, {dt, true, stress, options.pic_fraction, options.nmd, dt, false, options.transfer, options.moving_cells});
  agree_on_failure(model);
  if (model.failure)
    return;
  clock.begin(Phase::migration);
  if (options.moving_cells)
    move_cells(model, dt);
  else
    migrate_particles(model);
}
} // namespace mpm::explicit_scheme
