#pragma once
/// @file
/// Soils that are alike in stiffness, whose strains may be averaged together.

#include "materials/laws/law.h"

#include <span>
#include <vector>

namespace mpm::materials
{
/// P-wave modulus of a soil over that of the next softer one of its group, at most.
inline constexpr double largest_step_in_group = 1.25;

/// P-wave modulus of the stiffest soil of a group over that of the softest one, at most.
inline constexpr double largest_range_of_group = 4;

/// Groups laws by their stiffness.
///
/// Equilibrium gives soils of different stiffness different strains where they meet. A mean over both would strain the
/// stiff soil by what the soft one yields, and give it too large a stress; so these are averaged apart. Soils whose
/// stiffness rises in small steps are averaged together, as the rows of ground that becomes stiffer with depth: what a
/// row gets from the softer one above it loses to the stiffer one below, and rows averaged by themselves would lock.
/// A group ends where its range would be large, since soils at its ends may meet as well.
///
/// The stiffness is that at a mean effective stress of 100 kPa where it depends on it, of the soil without the pore
/// water, or in undrained soil with it.
/// @returns per law the number of its group, from 0 without gaps, by rising stiffness
std::vector<int> stiffness_groups(std::span<const Law> laws);
} // namespace mpm::materials
