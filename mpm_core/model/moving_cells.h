#pragma once
/// @file
/// Cells that move with the body: the nodes of cells with particles move by their velocities, so that no particle
/// leaves its cell. On linear simplices this is the total Lagrangian material point method (de Vaucorbeil, Nguyen &
/// Hutchinson 2020, A total-Lagrangian material point method for solid mechanics problems involving large
/// deformations): with F the deformation gradient of the cell, the gradients of its shape functions are F^-T times the
/// initial ones.
///
/// Anything but a step with moving cells begins with all nodes in their initial places; particles are then found in
/// other cells.

#include "base/table.h"
#include "model/model.h"

namespace mpm::model
{
/// A cell is too distorted when its smallest altitude, to which the critical time step is in proportion, is below this
/// fraction of the initial one.
inline constexpr double least_altitude = 0.1;

/// The places of nodes are looked at again when one may have moved by this fraction of the smallest altitude of a cell.
inline constexpr double longest_travel = 0.1;

/// Notes the initial places of the nodes, unless cells have moved already, and which nodes may meet the boundary.
/// @pre prepare(model) has been called
/// @note Collective
template <class G>
void begin_moving_cells(Model<G>& model);

/// Moves the nodes of the cells with particles by the velocities that move the particles, over dt [s].
/// @post the moments of these cells are about their new centres
template <class G>
void move_cells(Model<G>& model, double dt);

/// What is in the way of more steps with moving cells, the same text on all ranks; empty if nothing: a cell that is too
/// distorted, or a body about to meet the boundary of the mesh. It would not feel the boundary conditions of the nodes
/// there, which are not among those of its cells.
/// @pre a whole step has been taken
/// @note Collective
template <class G>
std::string end_of_moving_cells(Model<G>& model);

/// Moves all nodes back to their initial places, and searches the cells of the particles there. Does nothing when no
/// cell has moved.
/// @throws RunError on all ranks: a particle is outside of the mesh
/// @post Particles may have another order, and other ranks; prepare(model) is to be called
/// @note Collective
template <class G>
void reset_cells(Model<G>& model);

/// The corners of the cells with particles on this rank, for a checkpoint: number of the cell over all ranks, and
/// coordinates [m] of its nodes one after another.
template <class G, int D = G::dim>
Table moved_corners(const Model<G>& model);

/// The table that `moved_corners` gives, without rows.
template <int D>
Table no_moved_corners();

/// The mesh of a model as it was before cells moved.
template <class G, int D = G::dim>
Mesh<D> initial_mesh(const Model<G>& model);

/// Moves the nodes of a mesh to the corners that a checkpoint has.
/// @param owned  local number of each owned cell, by its number over all ranks; it has all cells of the table
/// @returns initial places and shapes
template <int D>
MovedCells<D> take_corners(const std::unordered_map<GlobalIndex, Index>& owned, const Table& corners, Mesh<D>& mesh);
} // namespace mpm::model
