#pragma once
/// @file
/// The stages of an implicit step, one of backward Euler or two of second order; see implicit_step.h.

#include "implicit/step.h"

namespace mpm::implicit
{
/// The only stage of a step, or the first one, from the velocities `field.start_velocity`.
template <class G>
void begin_first_stage(const VelocityField<G>& field, ImplicitStep<G>& step);

/// The second stage, after the first one has been solved; its first iterate goes to `field.velocity`.
/// @pre the step's forces belong to the solution of the first stage
template <class G>
void begin_second_stage(VelocityField<G>& field, ImplicitStep<G>& step);

/// Forces on a node, means over the stages so far, by their weights.
template <class G, int D = G::dim>
NodalForces<D> mean_forces(const ImplicitStep<G>& step, Index node);

/// a_i of the step: what its stages gain in velocity, over its length; none in a quasi-static step.
template <class G>
void find_acceleration(const ImplicitStep<G>& step, VelocityField<G>& field);

/// What a solved step of second order differs by from one of first order, u2 - dt v1 = g dt (v2 - v1): root mean square
/// over the mass [m]. An estimate of the error of the displacement of a step that errs on the safe side.
/// @note Collective
template <class G>
double displacement_error(const NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step);

/// Work done in the step, added to totals: forces act at its end, or at the ends of its stages, over its whole
/// displacement. That of the ghost penalty counts as damping.
/// @param owned  per node: 1 on exactly one of the ranks that share it
template <class G>
void add_work(const VelocityField<G>& field, const ImplicitStep<G>& step, std::span<const unsigned char> owned,
              Totals& totals);
} // namespace mpm::implicit
