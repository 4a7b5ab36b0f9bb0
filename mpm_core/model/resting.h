#pragma once
/// @file
/// Resting cells: linear finite elements with one material point, which turn into particles.
///
/// Their nodes are those of the particles around them. A resting cell has one row among the particles, which the step
/// treats as such but for two things: it does not move through the mesh, and its velocity and displacement have
/// gradients (transfer/resting.h). Conversion puts the particles that it stands for in its place, at the points of the
/// rule, with its stress and history and with velocities and displacements by its gradients: nodal mass, momentum and
/// force, and the energy, stay as they were.

#include "model/model.h"

namespace mpm::model
{
/// When a resting cell becomes particles, with those around it.
struct Conversion
{
  double plastic_strain = 0; ///< accumulated deviatoric strain of the cell or of a particle in it
  double displacement = 0;   ///< of a node since the cell began to rest, over the size of the cell
  int layers = 0;            ///< layers of cells around such a cell that are converted with it
};

/// Lets chosen cells rest: their particles become one row each, with the means of their values. Cells without particles
/// and those that rest already stay as they are.
/// @param chosen  per owned cell
/// @throws InputError on all ranks: several velocity fields; particles that are not as they were seeded, or that carry
/// tractions
/// @note Collective
template <class G>
void rest_cells(Model<G>& model, std::span<const unsigned char> chosen);

/// Turns the chosen resting cells of this rank into particles, and sorts. Moments, and so nodal sums, stay.
/// @param chosen  per owned cell
/// @pre prepare(model) has been called
template <class G>
void convert_cells(Model<G>& model, std::span<const unsigned char> chosen);

/// Turns the resting cells into particles that a criterion says, in the cell itself or within the layers around it.
/// @pre prepare(model) has been called
/// @note Collective
template <class G>
void convert_failing(Model<G>& model, const Conversion& conversion);
} // namespace mpm::model
