#pragma once
/// @file
/// Structural members in explicit steps: bars, struts and beams without mass, elastic and perfectly plastic, whose
/// nodes move with the soil (Hamad et al. 2015, Geotextiles and Geomembranes 43, 406-416, for membranes; rotations of
/// any size). A node takes the velocity of the nodes of its cell, and gives them its force, by the shape functions
/// times the density of the soil at these nodes: nodes that hardly have any mass neither move it nor are moved by it.

#include "model/model.h"

namespace mpm::model
{
/// Finds what members need of mesh and soil, after anything but a step has changed them: the cells of their nodes, the
/// volumes of the cells around the nodes of the mesh, and the density of the soil.
/// @param all_inside  whether no node may be outside of the mesh, also where soil may flow out
/// @throws RunError on all ranks, for a node outside of a mesh that soil may not leave
/// @note Collective where there are members
template <class G>
void begin_members(Model<G>& model, bool all_inside = false);

/// Updates the forces in the members and adds them to the tractions at the nodes of a field.
/// @pre sums of the field's nodes are there
/// @note Collective where there are members
template <class G>
void add_member_forces(Model<G>& model, VelocityField<G>& field);

/// Moves the nodes of the members with the soil.
/// @throws RunError as begin_members
/// @note Collective where there are members
template <class G>
void move_members(Model<G>& model, double dt);

/// Bound of the square of the highest frequency of the members with the mass of the soil around them [1/s2].
/// @note Collective where there are members
template <class G>
double squared_frequency_of_members(Model<G>& model);
} // namespace mpm::model
