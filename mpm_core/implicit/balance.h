#pragma once
/// @file
/// The balance of the forces at the nodes in an implicit step.

#include "implicit/trial.h"

namespace mpm::implicit
{
/// r = f_ext - f_int - ghost penalty - inertia of the forces at the nodes (I3), without supported directions.
template <class G>
void balance(const VelocityField<G>& field, ImplicitStep<G>& step);

/// Norms of the residual, that of the water included, and of the forces at work, and what the trial counted, over all
/// ranks.
/// @note Collective
template <class G>
TrialReport trial_report(const NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step,
                         const TrialCount<G::dim>& count);
} // namespace mpm::implicit
