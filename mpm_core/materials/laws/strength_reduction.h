#pragma once
/// @file
/// Laws with their strength divided by a factor: cohesion and tan(friction angle), or what stands for them.

#include "materials/laws/law.h"

namespace mpm::materials
{
/// c / F and tan(phi) / F. The dilation angle stays where it can, and is limited to the new friction angle: associated
/// flow stays associated.
MohrCoulomb reduced_strength(const MohrCoulomb& law, double factor);
/// The strength in the limit of slow loading; the viscosity stays.
ViscoplasticMohrCoulomb reduced_strength(const ViscoplasticMohrCoulomb& law, double factor);
/// Peak and residual strength alike
SofteningMohrCoulomb reduced_strength(const SofteningMohrCoulomb& law, double factor);
/// Strength and slope of the cone
DruckerPrager reduced_strength(const DruckerPrager& law, double factor);
/// The friction angle of the critical state, sin(phi) = 3M / (6 + M); attraction as it is
CamClay reduced_strength(const CamClay& law, double factor);
NorSand reduced_strength(const NorSand& law, double factor);
Sanisand reduced_strength(const Sanisand& law, double factor);
/// As `MohrCoulomb`; stiffness and cap stay.
HardeningSoil reduced_strength(const HardeningSoil& law, double factor);
/// Shear strengths under all normal stresses; associated flow stays associated.
HoekBrown reduced_strength(const HoekBrown& law, double factor);

/// Reduces the parameters that the law names.
/// @throws InputError it names none
ExternalLaw reduced_strength(const ExternalLaw& law, double factor);
Umat reduced_strength(const Umat& law, double factor);

/// Reduces the strength of all points.
Heterogeneous reduced_strength(const Heterogeneous& law, double factor);
/// Reduces the strength of the law that it is made of.
Hencky reduced_strength(const Hencky& law, double factor);
Undrained reduced_strength(const Undrained& law, double factor);

/// Says that the strength of a law is not known
struct UnknownStrength : InputError
{
  explicit UnknownStrength(const std::string& law)
      : InputError("law: the strength of " + law +
                   " is not known here; name its strength_parameters (of a UMAT or a law in Python), or give "
                   "factor_of_safety a function `reduce` of law and factor that returns the weaker law")
  {
  }
};

/// @throws InputError the strength of such a law is not known
template <class L>
L reduced_strength(const L& law, double)
{
  throw UnknownStrength(law_name(law));
}

template <class... L>
std::variant<L...> reduced_strength(const std::variant<L...>& law, double factor)
{
  return std::visit([&](const auto& l) -> std::variant<L...> { return reduced_strength(l, factor); }, law);
}
} // namespace mpm::materials
