#pragma once
/// @file
/// Parameters by which a law that is not of this library names its strength, so that it can be reduced.

#include <string_view>
#include <utility>
#include <vector>

namespace mpm::materials
{
/// What a parameter stands for
enum class StrengthKind
{
  strength,       ///< a cohesion, a yield stress or a slope: divided by the factor
  friction_angle, ///< [degrees]: its tangent is divided
  dilation_angle  ///< [degrees]: stays, but is at most the reduced friction angle that is named before it
};

/// Names of the kinds, in their order
inline constexpr std::string_view strength_kinds[] = {"strength", "friction angle", "dilation angle"};

/// The kind of a name
/// @throws InputError there is none
StrengthKind strength_kind(std::string_view name);

/// Throws InputError where a dilation angle is named before any friction angle.
void check(const std::vector<StrengthKind>& kinds);

/// Least tan(psi) / tan(phi) of the dilation angles and the friction angles before them; NaN where no dilation angle is
/// named.
double associated_fraction(const std::vector<StrengthKind>& kinds, const std::vector<double>& values);

/// Values of parameters with the strength divided by a factor.
/// @param kinds  of the values, one each
std::vector<double> reduced_values(const std::vector<StrengthKind>& kinds, std::vector<double> values, double factor);
} // namespace mpm::materials
