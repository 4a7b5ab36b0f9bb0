#pragma once
/// @file
/// How near plastic flow is to associated flow.

#include "materials/laws/law.h"

namespace mpm::materials
{
/// Dilation of a law over that of associated flow, tan(psi) / tan(phi): 1 where the strength does not depend on the
/// mean stress that the law gives, as in elastic and undrained soil; NaN for laws written in Python and UMATs that do
/// not name their dilation angle.
double associated_fraction(const Law& law);

/// Whether the strength of a law depends on the mean stress that it gives, while its flow dilates less than associated
/// flow would. False for elastic and undrained soil; true for laws written in Python and UMATs that do not name their
/// dilation angle.
bool is_non_associated(const Law& law);

/// Fraction of nodal mixed discretisation in a soil: less in frictional soil that hardly dilates. Forces of strains
/// that are averaged in full do not feel pressures that alternate from cell to cell: there these would cost the soil
/// strength.
double fraction_of_averages(const Law& law);

/// Fraction by which finite elements, steps in small displacements and steps with separate velocities of soil and water
/// average the forces of a soil whose strains they average in full: a half without dilation, and all in associated
/// flow. Averaged by less, tension alternates.
double fraction_of_averaged_forces(const Law& law);
} // namespace mpm::materials
