#pragma once
/// @file
/// How stresses are integrated over a cell (14), where not as the sum over its particles; see `Integration`.

#include "model/velocity_field.h"

namespace mpm::model
{
/// A cell is full when its particles fill this fraction of its volume (Al-Kafaji 2013, Formulation of a dynamic
/// material point method for geomechanical problems, section 3; so does Anura3D).
inline constexpr double full_fraction = 0.9;

/// A cell of ten particles is not full any more when two of them have moved on. So one counts as full, too, when the
/// cells around each of its nodes are filled by this fraction on the average; at a free surface it is about a half.
inline constexpr double full_fraction_around = 0.75;

/// The volume that a cell integrates its stress over. Cells that are not full, at the free surface, are left to their
/// particles in all modes: there stresses are small and nodes are light, so that forces from a mean with the cells
/// below would throw them off.
template <class G, int D = G::dim>
inline double integrated_volume(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  const bool whole = field.integration.kind != Integration::particles && field.integration.whole[cell];
  return whole ? cell_volume<G>(mesh.shapes[cell]) : field.moments[cell].volume;
}

/// What a cell integrates [N m]: the mean stress over its volume where it is full, the sum over its particles where it
/// is not, and in all cells when they are left to their particles.
/// @pre the internal forces of this step have been integrated: the full cells are known
template <class G, int D = G::dim>
Working<G> integrated_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell);

/// Puts the internal force of mixed integration in the place of the particles' sum, on this rank: a full cell
/// integrates the mean stress of its particles over its volume.
/// @post field.integration.whole tells which cells are full
/// @note Collective
template <class G, int D = G::dim>
void integrate_mixed(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field);

/// The same with dual domains: a full cell integrates the mean stress by their weights.
/// @pre not in axial symmetry
template <class G, int D = G::dim>
void integrate_dual_domains(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                            const std::vector<Run>& runs, VelocityField<G>& field);

/// Means of the velocity gradient over the full cells that share a node, from the nodes' `velocity`.
/// @note Collective
template <class G, int D = G::dim>
void average_gradients(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field);

/// The velocity gradient at a place in a cell by dual domains.
/// @pre average_gradients has been called for the field
template <class G>
Matrix<G::dim> dual_gradient(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const Vector<G::dim>& position,
                             Index cell);
} // namespace mpm::model
