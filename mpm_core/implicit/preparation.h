#pragma once
/// @file
/// Data of the mesh and the particles that an implicit step prepares before the first trial.

#include "implicit/step.h"

namespace mpm::implicit
{
/// Cells with particles, and the nodes that they touch: those that the step moves. A node may have stiffness and yet
/// hardly any mass.
/// @note Collective
template <class G>
void find_active(const Mesh<G::dim>& mesh, NodeExchange& exchange, const VelocityField<G>& field,
                 ImplicitStep<G>& step);

/// Gives the nodes with too little mass for a velocity of their own the mean of those of the other vertices of their
/// cells, from which their acceleration counts.
/// @pre the field's start velocities are those of the other nodes
/// @note Collective
template <class G>
void find_start_of_light_nodes(const Mesh<G::dim>& mesh, NodeExchange& exchange, VelocityField<G>& field);

/// Elastic stiffness of the nodes, and the frequencies that damping acts on (T5).
/// @note Collective
template <class G>
void find_frequencies(const Mesh<G::dim>& mesh, NodeExchange& exchange, const MaterialPoints<G::dim>& points,
                      const VelocityField<G>& field, ImplicitStep<G>& step);

/// Halos of the mesh, by the first step of a run on several ranks.
/// @note Collective
template <class G>
void make_halos_once(const Mesh<G::dim>& mesh, const NodeExchange& exchange, ImplicitStep<G>& step);
} // namespace mpm::implicit
