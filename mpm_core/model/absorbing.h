#pragma once
/// @file
/// Sides of the mesh that let waves out: dashpots of Lysmer & Kuhlemeyer (1969) with weak springs, to ground that moves
/// by an incoming wave, or as a free field.

#include "model/model.h"

namespace mpm::model
{
/// The ground behind a side, as it acts on it.
struct AbsorbingSide
{
  Index facet_tag;
  double normal_impedance; ///< rho c_p [kg/(m2 s)]; 0 for that of the soil at the side, infinite for a rigid side
  double shear_impedance;  ///< rho c_s; likewise
  double thickness; ///< of ground behind that acts as springs (lambda + 2 mu) / thickness and mu / thickness [m];
                    ///< infinite for none
  Index free_field; ///< number of the free field beside it; `none` for the incoming wave
};

/// Puts dashpots and springs at the nodes on the facets of soil with the tags of these sides. Soil with pore water has
/// the wave speeds and stiffnesses of undrained soil. Forces that hold these
/// nodes now, under gravity [m/s2], are kept.
/// @throws InputError on all ranks: several velocity fields, axial symmetry, a side where no soil is
/// @note Collective
template <class G>
void set_absorbing_sides(Model<G>& model, std::span<const AbsorbingSide> sides, const Vector<G::dim>& gravity);

/// Adds the forces of the ground beside absorbing sides but for those of dashpots over a step to the tractions at the
/// nodes of a field: what held them, springs and stresses of free fields. Nodes of driven sides get the velocity of the
/// ground at the start of the step and the force that leads to that at its end.
/// @param water  where it moves by itself: the forces act on soil and water as one mass, and are added to those of the
///               soil
/// @pre nodes have the sums of all ranks
template <class G>
void add_forces_of_ground(const Mesh<G::dim>& mesh, const Vector<G::dim>& gravity, double time, double dt,
                          VelocityField<G>& field, VelocityField<G>* water = nullptr);

/// Adds the forces of dashpots over a step to tractions and accelerations of the nodes. They act against the mean
/// velocity of the particles at a node over the step, dashpots included. These take energy out then, however stiff they
/// are, and do not limit the step. With the mean velocity of the node itself, whose acceleration the particles share
/// with those of other nodes, stiff dashpots would generate energy.
/// @param shared  whether velocities are those of particles, which share the accelerations of nodes; else each node has
///                its own
/// @pre start_velocity, velocity and accelerations are those without dashpots
template <class G>
void add_dashpot_forces(const Mesh<G::dim>& mesh, double time, double dt, bool shared, VelocityField<G>& field,
                        VelocityField<G>* water = nullptr);

/// Moves the springs with the mean velocity of soil and water at their nodes, relative to the free fields at a time.
template <class G>
void move_springs(const Mesh<G::dim>& mesh, double time, double dt, VelocityField<G>& field,
                  const VelocityField<G>* water = nullptr);
} // namespace mpm::model
