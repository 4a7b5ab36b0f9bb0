#include "materials/laws/association.h"

#include <cmath>
#include <numbers>

namespace mpm::materials
{
namespace
{
double fraction(const LinearElastic&) { return 1; }
double fraction(const CamClay&) { return 1; }
double fraction(const NorSand&) { return 1; }
double fraction(const Sanisand&) { return 1; }
double fraction(const ExternalLaw& law) { return law.association; }

double fraction(const Umat& law)
{
  const auto [kinds, values] = named_strength(law);
  return associated_fraction(kinds, values);
}

/// Of laws with both angles
template <class L>
requires requires(L law) { law.friction_angle + law.dilation_angle; }
double fraction(const L& law)
{
  constexpr double degree = std::numbers::pi / 180;
  const bool less = law.dilation_angle < law.friction_angle;
  return less ? std::tan(degree * law.dilation_angle) / std::tan(degree * law.friction_angle) : 1;
}

double fraction(const DruckerPrager& law) { return law.dilation < law.friction ? law.dilation / law.friction : 1; }
double fraction(const HoekBrown& law) { return law.dilation_ratio; }
double fraction(const ViscoplasticMohrCoulomb& law) { return fraction(law.inviscid); }
double fraction(const SofteningMohrCoulomb& law) { return fraction(law.peak); }

// The pressure of its water is most of what averages change, and its strength does not depend on that.
double fraction(const Undrained&) { return 1; }

double fraction(const Heterogeneous& law);
double fraction(const Hencky& law);

template <class... L>
double fraction(const std::variant<L...>& law)
{
  return std::visit([](const auto& one) { return fraction(one); }, law);
}

double fraction(const Heterogeneous& law) { return fraction(law.law); }
double fraction(const Hencky& law) { return fraction(law.law); }
} // namespace

double associated_fraction(const Law& law) { return fraction(law); }

bool is_non_associated(const Law& law) { return !(fraction(law) >= 1); }

double fraction_of_averages(const Law& law) { return is_non_associated(law) ? 0.5 : 1; }

double fraction_of_averaged_forces(const Law& law)
{
  const double associated = fraction(law);
  return std::isnan(associated) ? 1 : 0.5 * (1 + associated);
}
} // namespace mpm::materials
