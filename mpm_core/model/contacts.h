#pragma once
/// @file
/// The rigid surfaces of a model in an explicit step.

#include "model/model.h"

namespace mpm::model
{
/// The smallest gap between this rank's particles, those that resting cells stand for included, and a surface;
/// infinite without any [m].
template <class G>
double smallest_gap(const Model<G>& model, const Surface<G::dim>& surface);

/// Turns the resting cells into particles that a surface is near to, or will be: surfaces touch particles only. They
/// are those whose centre has the surface within three times the distance of their vertices, or where it moves there.
/// @param ahead  how long until this is called again [s]
/// @pre prepare(model) has been called
/// @note Not collective
template <class G>
void convert_near_surfaces(Model<G>& model, double ahead);

/// Begins a step of all contacts. @note Not collective
template <class G>
void begin_contacts(Model<G>& model, const TimeStep& step);

/// Ends a step: rigid bodies move.
/// @note Collective where the soil moves any of them
template <class G>
void end_contacts(Model<G>& model, const TimeStep& step);

/// What the soil of all ranks does to the bodies that it moves, by one sum.
/// @note Collective where there are any
template <class G>
void sum_reactions(Model<G>& model);

/// Adds the forces of all contacts to the tractions at the nodes of a field, over all ranks.
/// @pre sums and start velocities of the field's nodes are there
/// @note Collective where there are contacts
template <class G>
void add_contact_forces(Model<G>& model, double dt, VelocityField<G>& field);
} // namespace mpm::model
