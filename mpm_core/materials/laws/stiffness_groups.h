#pragma once
/// @file
/// Soils that are alike in stiffness, whose strains may be averaged together.

#include "materials/laws/law.h"

#include <span>
#include <vector>

namespace mpm::materials
{
/// Soils are in one group while the P-wave modulus of the stiffest is at most this many times that of the softest.
inline constexpr double alike_in_stiffness = 1.25;

/// Groups laws by their P-wave moduli, with the pore water in undrained soil.
///
/// Equilibrium gives soils of different stiffness different strains where they meet. A mean over both would strain the
/// stiff soil by what the soft one yields, and give it too large a stress; so these are averaged apart. Soils that are
/// alike are averaged together, so that a seam of a row of cells is not the stiffer for its own name.
/// @returns per law the number of its group, from 0 without gaps, by rising stiffness
std::vector<int> stiffness_groups(std::span<const Law> laws);
} // namespace mpm::materials
