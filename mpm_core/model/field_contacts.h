#pragma once
/// @file
/// Contact between velocity fields in an explicit step: momentum is exchanged at the nodes that both bodies have
/// (Bardenhagen, Brackbill and Sulsky 2000).
///
/// At such a node the accelerations without contact would give the bodies velocities v_1 and v_2 at the end of the
/// step. Where they approach each other by more than their gap, an impulse J n between them takes the rest of (v_1 -
/// v_2) . n away, and friction takes away the tangential part as far as |J_t| <= mu J_n + a A dt allows. The force J /
/// dt acts on both bodies with opposite signs, so that momentum is kept to round-off.
///
/// The normal is that of a surface along which the bodies touch. Normals from the volumes of the bodies were tried: a
/// particle more or less in a cell tilts them by 5 to 10 degrees on simplices, and as nodes whose normal is tilted
/// against the motion take most of the force, a smooth block was held back as if the coefficient of friction were 0.06
/// to 0.3.
///
/// The gap is that between the particles in the cells around the node, each half as wide as the side of a square or
/// cube of its volume.

#include "model/model.h"

namespace mpm::model
{
/// Finds the forces of all contacts between fields, over all ranks, and adds them to the tractions at the nodes.
/// @param gravity  [m/s2]
/// @pre sums, start velocities and tractions of all fields are there
/// @note Collective where there are such contacts
template <class G>
void add_field_contact_forces(Model<G>& model, const Vector<G::dim>& gravity, double dt);

/// Gives the velocities that move and strain particles what contact leaves the bodies: where a force presses them
/// together they keep their gap, and where they stick they do not slide. Momentum is kept.
///
/// The second mapping (19) spreads a force at a node over its neighbours, so that the velocities after it close or open
/// a contact that the accelerations have just balanced. To take away only what closes it is not enough: bodies then
/// open while forces act between them, and close after that without any, which generates energy in each vibration.
/// @pre the fields' `velocity` is that of their particles; the contact is that of the step's forces, or of those of the
/// step before where stresses are updated first
template <class G>
void separate_fields(Model<G>& model, double dt);
} // namespace mpm::model
