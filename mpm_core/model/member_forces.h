#pragma once
/// @file
/// The mechanics of a single structural member: what its deformation does to its nodes.

#include "base/tensor.h"
#include "model/member.h"

namespace mpm::model
{
/// A member with these nodes and these forces in it, undeformed otherwise.
/// @param axial_force  of its segments
/// @param moments  at its inner nodes; empty without bending
template <int D>
Member<D> make_member(std::string name, const MemberProperties& properties, std::vector<Vector<D>> positions,
                      std::vector<double> axial_force, std::vector<double> moments);

/// Updates the axial forces and moments of a member to the present places of its nodes, elastic and perfectly plastic;
/// returns the internal forces of the nodes.
template <int D>
std::vector<Vector<D>> internal_forces(Member<D>& member);

/// Sums of the rows of |B|^T L D |B|, with the strains B of a member and its stiffness D over the lengths L: bounds of
/// the eigenvalues of its stiffness by Gershgorin's theorem.
template <int D>
std::vector<double> stiffness_rows(const Member<D>& member);

/// How many nodes are moved by the soil: all but one that is held in space.
template <int D>
inline std::size_t moving_nodes(const Member<D>& member)
{
  return member.positions.size() - (member.properties.fixed_end ? 1 : 0);
}
} // namespace mpm::model
