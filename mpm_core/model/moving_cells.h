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
/// Notes the initial places of the nodes, unless cells have moved already, and which nodes may meet the boundary.
/// @pre prepare(model) has been called
/// @note Collective
template <class G>
void begin_moving_cells(Model<G>& model);

/// Moves the nodes of the cells with particles by the velocities that move the particles, over dt [s].
/// @post the moments of these cells are about their new centres
template <class G>
void move_cells(Model<G>& model, double dt);

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
