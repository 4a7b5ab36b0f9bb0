#pragma once
/// @file
/// What the flow of the pore water over an implicit step starts from.

#include "implicit/step.h"
#include "model/model.h"

namespace mpm::implicit
{
/// Sums over cells, the pressures of the nodes at the start, and the pressures prescribed at the end; the first iterate
/// keeps the others. Nothing where the model has no water; without unknowns where the step gives it no time.
/// @throws InputError water that cannot be compressed in a body whose pressure is not determined by anything
/// @note Collective
template <class G>
void start_pore_water(Model<G>& model, ImplicitStep<G>& step);
} // namespace mpm::implicit
