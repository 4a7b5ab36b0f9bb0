#pragma once
/// @file
/// Where cells can no longer move with the body; see model/moving_cells.h.

#include "model/model.h"

namespace mpm::model
{
/// A cell is too distorted when its smallest altitude, to which the critical time step is in proportion, is below this
/// fraction of the initial one.
inline constexpr double least_altitude = 0.1;

/// The places of nodes are looked at again when one may have moved by this fraction of the smallest altitude of a cell.
inline constexpr double longest_travel = 0.1;

/// Finds the nodes that may meet the boundary of the mesh first: those at the surface of the body that are not on it at
/// the start, and that no boundary condition holds; each with a cell around it.
/// @note Collective
template <class G>
void find_watched_nodes(Model<G>& model);

/// What is in the way of more steps with moving cells, the same text on all ranks; empty if nothing: a cell that is too
/// distorted, or a body about to meet the boundary of the mesh. It would not feel the boundary conditions of the nodes
/// there, which are not among those of its cells.
/// @pre a whole step has been taken
/// @note Collective
template <class G>
std::string end_of_moving_cells(Model<G>& model);
} // namespace mpm::model
