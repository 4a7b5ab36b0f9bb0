#pragma once
/// @file
/// Rigid bodies that forces move in an implicit step: along each axis that is free or controlled, the velocity of the
/// body is one more unknown, and its balance at the step's end one more equation,
///
///     0 = F + M g - sum f_p - M (V_1 - V_0) / dt,
///
/// with the applied force F and the forces f_p of contact on the particles. A controlled body has no mass. A body that
/// rotates freely has its spin as unknowns, constant in the step, and the balance of its angular momentum about its
/// centre,
///
///     0 = -sum a_p x f_p - (L_1 - L_0) / dt,   L = R I R^T omega,
///
/// both made a way and a force by its radius of gyration. With the displacement q of these axes the system is
///
///     [J  B] [du]   [r]
///     [C  E] [dq] = [R],   B = -dr/dq,  C = -dR/du,  E = -dR/dq,
///
/// of which the columns B and the rows C are few: newton.py eliminates du.

#include "implicit/contact_step.h"
#include "implicit/system.h"

namespace mpm::implicit
{
/// Finds what moves in the step: from rest where it is quasi-static, else with the velocity of the step before.
/// @pre no body collides, and the step has one stage
template <class G>
void start_bodies(const Model<G>& model, ImplicitStep<G>& step);

/// The balance of the bodies in the trial, and its derivatives where tangents are wanted.
/// @note Collective where forces move any
template <class G>
void balance_bodies(Model<G>& model, bool tangents, ImplicitStep<G>& step);

/// Adds the balance of the bodies to the norms of a trial.
template <class G>
void add_bodies(const ImplicitStep<G>& step, TrialReport& report);

/// Velocities of a body along and about the axes on which forces move it; zero along the others.
template <int D>
Motion<D> driven_motion(const DrivenBodies<D>& bodies, std::size_t surface);
} // namespace mpm::implicit
