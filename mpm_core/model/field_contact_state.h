#pragma once
/// @file
/// Contact between velocity fields in a checkpoint: what the next step needs to know of the last one.

#include "base/table.h"
#include "model/model.h"

namespace mpm::model
{
/// The nodes in contact, by cell: for each of its vertices gap, 1 where the bodies stick, force and shift; zeros where
/// there is no contact.
template <class G, int D = G::dim>
Table touching_table(const Model<G, D>& model, std::size_t contact);

/// The same without rows.
template <int D>
Table empty_touching_table(std::size_t contact);

/// Takes the nodes in contact from a table.
/// @pre the model has its last time step
template <class G, int D = G::dim>
void take_touching(Model<G, D>& model, const Table& table, std::size_t contact);
} // namespace mpm::model
