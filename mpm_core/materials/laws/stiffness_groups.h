#pragma once
/// @file
/// Soils that are alike in stiffness, whose strains may be averaged together.

#include "materials/laws/law.h"

#include <span>
#include <vector>

namespace mpm::materials
{
/// Largest P-wave modulus of a class of stiffness over its least one.
inline constexpr double width_of_class = 1.25;

/// Groups laws by classes of stiffness, which are bounded by powers of `width_of_class` in Pa.
///
/// Equilibrium gives soils of different stiffness different strains where they meet. A mean over both would strain the
/// stiff soil by what the soft one yields, and give it too large a stress; so these are averaged apart. Soils of a
/// class are averaged together, so that a seam of a row of cells is not the stiffer for its own name. The class of a
/// law depends on nothing else, so that elements and particles with other lists of laws average alike.
///
/// The stiffness is that at a mean effective stress of 100 kPa where it depends on it, of the soil without the pore
/// water, or in undrained soil with it.
/// @returns per law the number of its group, from 0 without gaps, by rising stiffness
std::vector<int> stiffness_groups(std::span<const Law> laws);
} // namespace mpm::materials
