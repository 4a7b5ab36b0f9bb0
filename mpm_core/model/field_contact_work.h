#pragma once
/// @file
/// Energy that contact between velocity fields dissipates in explicit steps.
///
/// Particles get the accelerations a, with forces f of contact among them, and then have the nodal velocities v + C a
/// dt, where C is the second mapping (19). They are moved and strained by the velocities v' = v + C a dt + d that
/// contact leaves the bodies, by `separate_fields`. Their kinetic energy therefore changes by the work of all forces on
/// v, that of the stresses by their forces' work on v', and the rest is what contact dissipates: with F for all other
/// forces and step n,
///
///     W_n = dt / 2 sum over both bodies of [F_n . d_n - F_int,n . d_(n-1) - f_n . (v_n + C a_n dt + v_n)]
///
/// where v_n is the velocity at the start of the step. F_n . d_n has the stresses at the start of a step and F_int,n .
/// d_(n-1) those at the end of the one before.
/// Where the bodies stay in contact along the normal, the relative velocity r_n of v_n is taken away by f_n, and
/// d_(n-1) is -r_n. The sum over steps is then that of mu (r_n + r_(n+1))^2 / 4 with the reduced mass mu, and positive.

#include "model/model.h"

namespace mpm::model
{
/// Charges the shifts of the step before with the work of the stresses that they have caused.
/// @pre the nodes have the internal forces of the present stresses, and the contacts are those of the step before
template <class G>
void note_shift_work(Model<G>& model);

/// The same for the forces of the step before, on the velocities that they have given: where stresses are updated
/// first, the nodes do not have these velocities in that step itself.
template <class G>
void note_late_work(Model<G>& model);

/// Takes the work of contacts between fields out of the external work; what they dissipate is `friction_work`.
/// @param late  the work of the forces on the velocities that they give is left to `note_late_work`
/// @pre the contacts are those of this step, and the fields' velocities those that move particles
template <class G>
void note_field_contact_work(Model<G>& model, double dt, bool late = false);
} // namespace mpm::model
