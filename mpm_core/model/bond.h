#pragma once
/// @file
/// The bond between a bar and the soil: a bar that is pulled harder than the bond holds slips along its line.

#include <vector>

namespace mpm::model
{
/// A bar whose nodes all stick to the soil.
struct BondedBar
{
  std::vector<double> force;         ///< of each segment [N/m]
  std::vector<double> stiffness;     ///< E A / L of each segment [N/m2]
  std::vector<double> least;         ///< axial force that each segment carries, not above 0 [N/m]
  std::vector<double> largest;       ///< likewise, not below 0
  std::vector<double> bond_strength; ///< largest force between soil and each node [N/m]; infinite where it is connected
};

/// Largest force between soil and each node of a bar: over half of the segments beside it; infinite where it cannot
/// slip.
/// @param lengths  of its segments [m]
/// @param strength  per length [N/m2]
/// @param has_free_length  whether the first segment has no bond
/// @param connected, fixed_end  whether the first and the last node cannot slip
std::vector<double> bond_strengths(const std::vector<double>& lengths, double strength, bool has_free_length,
                                   bool connected, bool fixed_end);

/// Axial forces after the nodes have slipped along the bar as far as they must: the admissible forces that are nearest
/// to the given ones in complementary energy, sum (N - N_stick)^2 / (2 E A / L). Forces are admissible within the
/// strength of the segments, if those on both sides of a node differ by no more than its bond holds; there is none
/// beyond the ends.
///
/// Found exactly by dynamic programming: along the bar, the derivative of the least energy of the segments so far by
/// the force of the last one is piecewise linear. A bond lets that force change by its strength for nothing.
/// @returns force of each segment [N/m]
std::vector<double> forces_with_slip(const BondedBar& bar);
} // namespace mpm::model
