#pragma once
/// @file
/// The data of a structural member.

#include "transfer/nodes.h"

#include <array>
#include <string>
#include <vector>

namespace mpm::model
{
/// What a member is made of: stiffness and strength per metre out of the plane in plane strain, of itself in three
/// dimensions.
struct MemberProperties
{
  double axial_stiffness;      ///< E A [N/m]
  double bending_stiffness;    ///< E I [N m2/m]; 0 without bending
  double tensile_strength;     ///< [N/m]
  double compressive_strength; ///< a positive number [N/m]
  double plastic_moment;       ///< [N m/m]
  double bond_strength;        ///< largest force between it and the soil per length [N/m2]; infinite without slip
  bool has_free_length;        ///< whether its first segment has no bond
  bool connected;              ///< whether its first node does not slip in any case
  bool fixed_end;              ///< whether its last node is held in space
};

/// Where a node of a member is in the mesh, on the rank that owns its cell.
template <int D>
struct MemberHost
{
  Index cell = none; ///< owned by this rank, or `none`
  /// Of the nodes of the cell, by how full of soil it is there; all zero where there is none
  std::array<double, D + 1> weights{};
};

/// A bar, strut or beam: a chain of straight segments between nodes that move with the soil. All ranks have the same
/// values, except for those of the hosts.
template <int D>
struct Member
{
  std::string name; ///< for messages
  MemberProperties properties;
  std::vector<Vector<D>> positions;      ///< of its nodes [m]
  std::vector<double> initial_lengths;   ///< of its segments, over which its stiffness counts [m]
  std::vector<double> free_lengths;      ///< of the segments without force, which plastic flow changes [m]
  std::vector<double> free_angles;       ///< by which it turns at its inner nodes without moment; empty without bending
  std::vector<double> axial_force;       ///< of each segment, tension positive [N/m]
  std::vector<double> moments;           ///< at its inner nodes [N m/m]; empty without bending
  std::vector<unsigned char> is_in_soil; ///< of its nodes, as of the last step
  std::vector<GlobalIndex> cells;        ///< that hold its nodes, by their numbers over all ranks
  std::vector<MemberHost<D>> hosts;
};
} // namespace mpm::model
