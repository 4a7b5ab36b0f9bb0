#pragma once
/// @file
/// The rigid surfaces of a model in an explicit step.

#include "model/model.h"

namespace mpm::model
{
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
