#pragma once
/// @file
/// How stresses are integrated over a cell (14), where not as the sum over its particles; see `Integration`.

#include "model/model.h"

#include <initializer_list>

namespace mpm::model
{
/// A cell is full when its particles fill this fraction of its volume (Al-Kafaji 2013, Formulation of a dynamic
/// material point method for geomechanical problems, section 3; so does Anura3D).
inline constexpr double full_fraction = 0.9;

/// A cell of ten particles is not full any more when two of them have moved on. So one counts as full, too, when the
/// cells around each of its nodes are filled by this fraction on the average; at a free surface it is about a half.
inline constexpr double full_fraction_around = 0.75;

/// A node has little mass when it has less than this fraction of what particles that fill the cells around it evenly
/// would give it: all of them are far from it, in the corners of its cells, as where a rigid surface cuts off the rest.
inline constexpr double little_mass = 0.3;

/// The volume that a cell integrates its stress over. Cells that are not full, at the free surface, are left to their
/// particles in all modes: there stresses are small and nodes are light, so that forces from a mean with the cells
/// below would throw them off.
template <class G, int D = G::dim>
inline double integrated_volume(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  const bool whole = field.integration.kind != Integration::particles && field.integration.whole[cell];
  return whole ? cell_volume<G>(mesh.shapes[cell]) : field.moments[cell].volume;
}

/// That volume over the volume of the cell's particles: what sums over these are multiplied by.
template <class G, int D = G::dim>
inline double integration_factor(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  return integrated_volume(mesh, field, cell) / field.moments[cell].volume;
}

/// Whether forces are averaged over nodes; strains may be without them.
template <int D>
inline bool has_averaged_forces(const CellIntegration<D>& integration)
{
  return !integration.averaged_by_law.empty();
}

/// The fraction of nodal mixed discretisation in a cell, that of its forces.
template <int D>
inline double averaged_fraction(const CellIntegration<D>& integration, Index cell)
{
  return integration.averaged_of_cell.empty() ? 1 : integration.averaged_of_cell[cell];
}

/// The volume by which a cell takes part in the means over nodes: means that are weighted by it leave a uniform strain
/// or stress as it is, also where soils of different fractions meet.
template <class G, int D = G::dim>
inline double averaged_volume(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  return averaged_fraction(field.integration, cell) * integrated_volume(mesh, field, cell);
}

/// The fraction of nodal mixed discretisation of the strains of a cell; none where no forces are averaged.
template <int D>
inline double averaged_strain_fraction(const CellIntegration<D>& integration, Index cell)
{
  const double of_forces = averaged_fraction(integration, cell);
  return integration.strains_in_full && of_forces > 0 ? 1 : of_forces;
}

/// The volume by which a cell takes part in the means of strains.
template <class G, int D = G::dim>
inline double averaged_strain_volume(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  return averaged_strain_fraction(field.integration, cell) * integrated_volume(mesh, field, cell);
}

/// Finds the soils whose cells are averaged together over nodes: of each field those of like stiffness.
template <class G>
void group_soils(Model<G>& model);

/// Averages these groups of soils apart from here on, or nothing.
template <class G>
inline void choose_groups(Model<G>& model, bool averages)
{
  for (VelocityField<G>& field : model.fields)
    field.integration.groups.count = averages ? field.integration.n_groups : 1;
}

/// The group in which each cell is averaged: that of the most of its particles, of the softer soil where two have as
/// many.
/// @param runs          of the particles, and of the rows of resting cells
/// @param group_by_law  negative outside of the field
template <int D>
AveragedGroups averaged_groups(const Mesh<D>& mesh, std::initializer_list<std::span<const Run>> runs,
                               const std::vector<int>& group_by_law, int count);

/// Finds what the cells integrate in this step, where it is not the sum over their particles: a full cell integrates
/// the mean stress of its particles over its volume (mixed), or the mean stress by the weights of dual domains.
/// @post field.integration.whole tells which cells are full
/// @pre no dual domains in axial symmetry
/// @note Collective where stresses are integrated over whole cells
template <class G, int D = G::dim>
void begin_integration(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                       const std::vector<Run>& runs, VelocityField<G>& field);

/// What a full cell integrates [N m]: the mean stress of its particles, or that of dual domains, over its volume.
template <class G, int D = G::dim>
Working<G> full_cell_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell);

/// What a cell integrates [N m]: the above where it is full, the sum over its particles where it is not, and in all
/// cells when they are left to their particles.
/// @pre begin_integration has been called
template <class G, int D = G::dim>
inline Working<G> integrated_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell)
{
  const bool whole = field.integration.kind != Integration::particles && field.integration.whole[cell];
  return whole ? full_cell_stress(mesh, field, cell) : field.moments[cell].stress;
}

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
