#pragma once
/// @file
/// The one pass over the particles in a step: nodes to particles, stress update, and the moments for the next step.

#include "model/affine.h"

namespace mpm::model
{
/// Options of the pass.
struct PassOptions
{
  double dt;           ///< [s]
  bool move;           ///< velocities (18) and positions (20)
  bool stress;         ///< strain increment and stress update
  double pic_fraction; ///< PIC fraction: part of the nodal velocity in the particle's, 0 is FLIP
  bool nmd;            ///< take volumetric strains from the field's `volumetric_strain` (nodal mixed discretisation)
  double law_dt;       ///< duration of the increment for laws [s]; infinite where they are given all time
  bool small = false;  ///< small displacements: the strain changes stresses only, not volumes, and rotates nothing
  Transfer transfer = Transfer::flip;
  bool moving_cells = false;       ///< the cells move with the particles, which stay in them
  bool count_displacement = false; ///< of particles that do not move: as if they had
};

/// Goes once over the particles, batch by batch, each run of particles in one cell at a time: moves them with the nodal
/// `velocity_change` and `velocity` of their field, updates their stresses, finds their cells, and sums the moments
/// of the particles as they are then. Particles in ghost cells are put on the list of migrating ones, those that are in
/// no local cell on the list of lost ones, and neither is added to moments.
template <class G>
void particle_pass(Model<G>& model, const PassOptions& options);
} // namespace mpm::model
