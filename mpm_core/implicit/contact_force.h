#pragma once
/// @file
/// Contact with rigid surfaces, a term of the residual of an implicit step; see contact/end_of_step.h.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// The moduli of the soil by which contact is stiff in a step.
template <class G>
void start_contacts(const Model<G>& model, ImplicitStep<G>& step);

/// The particles that touch in the trial, their forces at nodes, and their blocks of the tangent where it is wanted.
/// @pre `field.velocity` is the iterate, also at nodes of other ranks
template <class G>
void try_contacts(Model<G>& model, bool tangents, ImplicitStep<G>& step);

template <class G, int D = G::dim>
void add_contact_forces(const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces);

template <class G, int D = G::dim>
void add_contact_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, TangentSum<D>& tangent);

/// Gives particles their slip and surfaces what they feel in the trial. @pre places are still those of the step's start
template <class G>
void keep_slip(Model<G>& model, const ImplicitStep<G>& step);

/// Keeps the forces on surfaces at the end of the first of two stages.
template <class G>
void keep_contact_forces(ImplicitStep<G>& step);

/// Moves the bodies to where they are at the end of the trial; the step is accepted.
template <class G>
void move_bodies(Model<G>& model, const ImplicitStep<G>& step);

/// Adds the forces of the accepted trial to the tractions of the nodes, which have the sums of the particles again.
/// @note Collective where there are contacts
template <class G>
void add_contact_tractions(Model<G>& model, const ImplicitStep<G>& step);
} // namespace mpm::implicit
