#include "materials/laws/strength_reduction.h"

#include "materials/laws/strength_parameters.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mpm::materials
{
namespace
{
constexpr double degree = std::numbers::pi / 180;

/// The angle [degrees] whose tangent is that of another one over a factor
double divided(double angle, double factor) { return std::atan(std::tan(angle * degree) / factor) / degree; }

/// The slope M in triaxial compression that goes with the tangent of its friction angle over a factor
double divided_slope(double slope, double factor)
{
  const double angle = std::asin(3 * slope / (6 + slope));
  const double sine = std::sin(std::atan(std::tan(angle) / factor));
  return 6 * sine / (3 - sine);
}

/// The dilation that goes with a reduced friction
double limited(double dilation, double friction_before, double friction)
{
  return dilation == friction_before ? friction : std::min(dilation, friction);
}
} // namespace

StrengthKind strength_kind(std::string_view name)
{
  const auto found = std::find(std::begin(strength_kinds), std::end(strength_kinds), name);
  if (found == std::end(strength_kinds))
    throw InputError("strength_parameters names '" + std::string(name) +
                     "', expected 'strength', 'friction angle' or 'dilation angle'");
  return static_cast<StrengthKind>(found - std::begin(strength_kinds));
}

void check(const std::vector<StrengthKind>& kinds)
{
  const auto dilation = std::find(kinds.begin(), kinds.end(), StrengthKind::dilation_angle);
  if (dilation != kinds.end() && std::find(kinds.begin(), dilation, StrengthKind::friction_angle) == dilation)
    throw InputError(
        "strength_parameters names a dilation angle, expected the friction angle that limits it before it");
}

std::vector<double> reduced_values(const std::vector<StrengthKind>& kinds, std::vector<double> values, double factor)
{
  double before = 0, friction = 0;
  for (std::size_t k = 0; k < kinds.size(); ++k)
    switch (kinds[k])
    {
    case StrengthKind::strength:
      values[k] /= factor;
      break;
    case StrengthKind::friction_angle:
      before = values[k];
      friction = values[k] = divided(before, factor);
      break;
    case StrengthKind::dilation_angle:
      values[k] = limited(values[k], before, friction);
    }
  return values;
}

double associated_fraction(const std::vector<StrengthKind>& kinds, const std::vector<double>& values)
{
  double friction = 0, least = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t k = 0; k < kinds.size(); ++k)
    if (kinds[k] == StrengthKind::friction_angle)
      friction = values[k];
    else if (kinds[k] == StrengthKind::dilation_angle)
    {
      const bool less = values[k] < friction;
      least = std::fmin(least, less ? std::tan(values[k] * degree) / std::tan(friction * degree) : 1);
    }
  return least;
}

MohrCoulomb reduced_strength(const MohrCoulomb& law, double factor)
{
  MohrCoulomb reduced = law;
  reduced.cohesion = law.cohesion / factor;
  reduced.friction_angle = divided(law.friction_angle, factor);
  reduced.dilation_angle = limited(law.dilation_angle, law.friction_angle, reduced.friction_angle);
  return reduced;
}

ViscoplasticMohrCoulomb reduced_strength(const ViscoplasticMohrCoulomb& law, double factor)
{
  return {reduced_strength(law.inviscid, factor), law.viscosity};
}

SofteningMohrCoulomb reduced_strength(const SofteningMohrCoulomb& law, double factor)
{
  SofteningMohrCoulomb reduced = law;
  reduced.peak = reduced_strength(law.peak, factor);
  reduced.residual_cohesion = law.residual_cohesion / factor;
  reduced.residual_friction_angle = divided(law.residual_friction_angle, factor);
  reduced.residual_dilation_angle =
      limited(law.residual_dilation_angle, law.residual_friction_angle, reduced.residual_friction_angle);
  return reduced;
}

DruckerPrager reduced_strength(const DruckerPrager& law, double factor)
{
  DruckerPrager reduced = law;
  reduced.strength = law.strength / factor;
  reduced.friction = law.friction / factor;
  reduced.dilation = limited(law.dilation, law.friction, reduced.friction);
  return reduced;
}

Heterogeneous reduced_strength(const Heterogeneous& law, double factor)
{
  std::visit([&](const auto& l) { reduced_strength(l, factor); }, law.law); // whether its strength is known
  Heterogeneous reduced = law;
  reduced.strength_factor *= factor;
  return reduced;
}

ExternalLaw reduced_strength(const ExternalLaw& law, double factor)
{
  if (!law.weaker)
    throw UnknownStrength(law_name(law));
  return law.weaker(factor);
}

Umat reduced_strength(const Umat& law, double factor)
{
  if (law.strength.empty())
    throw UnknownStrength(law_name(law));
  const auto [kinds, before] = named_strength(law);
  const std::vector<double> values = reduced_values(kinds, before, factor);
  Umat reduced = law;
  for (std::size_t k = 0; k < values.size(); ++k)
    reduced.properties[static_cast<std::size_t>(law.strength[k].first - 1)] = values[k];
  return reduced;
}

Hencky reduced_strength(const Hencky& law, double factor) { return {reduced_strength(law.law, factor)}; }

Undrained reduced_strength(const Undrained& law, double factor)
{
  return {reduced_strength(law.skeleton, factor), law.water_modulus, law.porosity};
}

CamClay reduced_strength(const CamClay& law, double factor)
{
  CamClay reduced = law;
  reduced.critical_slope = divided_slope(law.critical_slope, factor);
  return reduced;
}

NorSand reduced_strength(const NorSand& law, double factor)
{
  NorSand reduced = law;
  reduced.critical_slope = divided_slope(law.critical_slope, factor);
  return reduced;
}

HardeningSoil reduced_strength(const HardeningSoil& law, double factor)
{
  HardeningSoil reduced = law;
  reduced.strength_factor *= factor;
  return reduced;
}

HoekBrown reduced_strength(const HoekBrown& law, double factor)
{
  HoekBrown reduced = law;
  reduced.strength_factor *= factor;
  return reduced;
}

Sanisand reduced_strength(const Sanisand& law, double factor)
{
  Sanisand reduced = law;
  reduced.critical_slope = divided_slope(law.critical_slope, factor);
  return reduced;
}
} // namespace mpm::materials
