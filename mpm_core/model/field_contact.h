#pragma once
/// @file
/// Contact of two bodies of soil that move with different velocity fields.

#include "contact/surfaces.h"

#include <vector>

namespace mpm::model
{
/// A node at which two bodies are in contact in this step.
template <int D>
struct ContactNode
{
  Index node;
  Vector<D> normal; ///< unit, from the first body to the second
  double gap;       ///< between the particles of the two; at least zero [m]
  Vector<D> force;  ///< on the second body [N]; the opposite acts on the first
  bool sticks;      ///< whether friction and adhesion stop all slip
  /// By how much the second body moved in this step beside the motion of its particles, times its mass, and the first
  /// body the other way [kg m].
  Vector<D> shift;
};

/// How far the particles of two bodies reach along the normal, the second ones against it, seen from a node [m].
struct Reaches
{
  double first, second;
};

/// Scratch data of a contact; undefined between steps.
template <int D>
struct ContactScratch
{
  std::vector<Index> nodes, cells;               ///< nodes that both bodies have, and this rank's cells around them
  std::vector<unsigned char> has_node, has_cell; ///< 1 for those; by node and cell of the mesh
  std::vector<Vector<D>> normals;                ///< by node of the mesh, as all that follows
  std::vector<Reaches> reaches;
  std::vector<Vector<D>> areas;
};

/// Contact between two velocity fields, with friction and adhesion.
template <int D>
struct FieldContact
{
  Index first, second;
  double friction;                      ///< coefficient mu of Coulomb
  double adhesion;                      ///< shear strength without pressure [Pa]
  Surface<D> interface;                 ///< along which they touch; its normal points from the first body to the second
  std::vector<ContactNode<D>> touching; ///< of the last step, by rising node
  double dt = 0;                        ///< of that step [s]
  Vector<D> force{};                    ///< on the second body in the last step; this rank's part [N]
  Vector<D> impulse{};                  ///< on the second body since the contact was declared; this rank's part [N s]
  ContactScratch<D> scratch;
};
} // namespace mpm::model
