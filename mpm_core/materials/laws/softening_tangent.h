#pragma once
/// @file
/// Consistent tangent of softening Mohr-Coulomb soil.

#include "materials/laws/softening_strength.h"
#include "materials/tools/spectral.h"

namespace mpm::materials::mohr_coulomb
{
/// Writes the tangent of a point that yielded: that of the surface on which it ends, and what the loss of strength
/// adds.
/// @param frame      principal directions of the trial stress
/// @param increment  plastic strain
/// @param tangent    (components, components), row by row
template <int D>
void write_softening_tangent(const SofteningPoint& point, const Frame<D>& frame, double increment, double* tangent);
} // namespace mpm::materials::mohr_coulomb
