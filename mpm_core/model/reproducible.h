#pragma once
/// @file
/// Moments of cells that do not depend on the order of the particles.

#include "model/model.h"

namespace mpm::model
{
/// Sums the moments of all cells over their particles again, so that they are the same to the last bit in whatever
/// order the particles are and have come.
/// @pre prepare(model) has been called
template <class G>
void sum_rounded_moments(Model<G>& model);
} // namespace mpm::model
