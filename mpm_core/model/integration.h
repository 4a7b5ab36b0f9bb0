#pragma once
/// @file
/// How stresses are integrated over a cell (14), where not as the sum over its particles; see `Integration`.

#include "model/model.h"
#include "transfer/cell_strain.h"

namespace mpm
{
/// A cell is full when its particles have this share of its volume (Al-Kafaji 2013, Formulation of a dynamic material
/// point method for geomechanical problems, section 3; so does Anura3D).
inline constexpr double full_share = 0.9;

/// A cell of ten particles is not full any more when two of them have moved on. So one counts as full, too, when the
/// cells around each of its nodes are filled by this share on the average; at a free surface it is about a half.
inline constexpr double full_share_around = 0.75;

/// The volume that a cell integrates its stress over. Cells that are not full, at the free surface, are left to their
/// particles in all modes: there stresses are small and nodes are light, so that forces from a mean with the cells
/// below would throw them off.
template <int D>
inline double integrated_volume(const Model<D>& model, Index cell)
{
  const bool whole = model.integration != Integration::particles && model.work.whole[cell];
  return whole ? model.mesh.shapes[cell].volume : model.work.moments[cell].volume;
}

/// Puts the internal force of mixed or dual domain integration in the place of the particles' sum, on this rank.
/// @post work.whole tells which cells are full
/// @note Collective
template <int D>
void integrate_stress(Model<D>& model);

/// Means of the velocity gradient over the full cells that share a node, from the nodes' `velocity`.
/// @note Collective
template <int D>
void average_gradients(Model<D>& model);

/// The velocity gradient at a particle by dual domains.
/// @pre average_gradients(model) has been called
template <int D>
Matrix<D> dual_gradient(const Model<D>& model, Index particle, Index cell);
} // namespace mpm
