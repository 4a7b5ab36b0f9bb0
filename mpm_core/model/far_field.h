#pragma once
/// @file
/// The far field of a velocity field: how it begins, what it does to the nodes of its border, and how these move it.

#include "model/model.h"

namespace mpm::model
{
/// Forces out of balance at nodes of the mesh, by their numbers over all ranks, without those of a far field [N]. A
/// node that another rank owns has zeros.
/// @throws InputError on all ranks: a node that no rank has, or without soil around it
/// @note Collective
template <class G>
std::vector<Vector<G::dim>> unbalanced_at(Model<G>& model, std::span<const GlobalIndex> nodes,
                                          const Vector<G::dim>& gravity);

/// Gives the model a far field.
/// @param nodes         of the border, by their numbers over all ranks
/// @param stiffness     (nodes D, nodes D) [N/m]
/// @param mass          (nodes, D, D) [kg]
/// @param held          (nodes, D) [N]
/// @param displacement  (nodes, D) [m]
template <class G>
void set_far_field(Model<G>& model, std::span<const GlobalIndex> nodes, std::span<const double> stiffness,
                   std::span<const double> mass, std::span<const double> held, std::span<const double> displacement);

/// Adds the forces of the far field, as it is now, to those on this rank's nodes of its border.
template <int D>
void add_far_field_forces(const FarField<D>& far, const Vector<D>& gravity, std::span<Vector<D>> forces);

/// Values of a vector at all nodes of the border, (size, D), times a factor.
/// @note Collective where there is a far field
template <int D>
std::vector<double> border_values(const NodeExchange& exchange, const FarField<D>& far,
                                  std::span<const Vector<D>> nodal, double factor);

/// Moves the border with its nodes over a time.
/// @note Collective where there is a far field
template <class G>
void move_border(const NodeExchange& exchange, double dt, VelocityField<G>& field);
} // namespace mpm::model
