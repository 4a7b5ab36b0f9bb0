#include "materials/laws/drucker_prager.h"

#include "materials/tools/deviator.h"
#include "materials/tools/elasticity.h"
#include "materials/tools/separation.h"

#include <numbers>

namespace mpm::materials
{
namespace
{
constexpr double infinity = std::numeric_limits<double>::infinity();

/// The law with the constants of its returns worked out
struct Cone
{
  ElasticModuli moduli;
  double bulk;
  double strength, friction, dilation;
  double tension; ///< largest mean stress: the cut-off, or the apex where that comes first
  double corner;  ///< sqrt(J2) where cone and cut-off meet
};

Cone cone_of(const DruckerPrager& law)
{
  const ElasticModuli moduli = elastic_moduli(law.young, law.poisson);
  const double apex = law.friction > 0 ? law.strength / law.friction : infinity;
  const double tension = std::min(law.tension_cutoff, apex);
  const double corner = tension < apex ? law.strength - (law.friction > 0 ? law.friction * tension : 0.0) : 0.0;
  return {moduli, bulk_modulus(moduli), law.strength, law.friction, law.dilation, tension, corner};
}

enum class ReturnPart
{
  elastic,
  cone,
  cut_off,
  corner
};

/// Mean stress and ratio of the deviator to that of the trial stress after the return
struct Returned
{
  ReturnPart part;
  double mean;
  double ratio;
};

/// Return of a trial stress of mean p and sqrt(J2) j. In the plane of p and j both surfaces are lines.
Returned return_to_cone(const Cone& c, double p, double j)
{
  const double excess = j + c.friction * p - c.strength;
  const double tolerance = 1e-12 * (j + std::abs(p) + c.strength); // a stress that was returned counts as elastic
  if (excess <= tolerance && p - c.tension <= tolerance)
    return {ReturnPart::elastic, p, 1};
  const double multiplier = excess / (c.moduli.shear + c.bulk * c.friction * c.dilation);
  const double mean = p - c.bulk * c.dilation * multiplier;
  if (excess > 0 && mean <= c.tension)
    return {ReturnPart::cone, mean, (c.strength - c.friction * mean) / j};
  if (j <= c.corner)
    return {ReturnPart::cut_off, c.tension, 1};
  return {ReturnPart::corner, c.tension, c.corner / j};
}

template <int D>
void write_tangent(const Cone& c, const Returned& returned, const SymTensor<D>& s, double j, double* tangent)
{
  const double shear = c.moduli.shear, r = returned.ratio;
  switch (returned.part)
  {
  case ReturnPart::elastic:
    return;
  case ReturnPart::cut_off:
    return write_deviatoric_tangent<D>(s, 1, shear, {0, 0, 0, 0}, tangent);
  case ReturnPart::corner:
    return write_deviatoric_tangent<D>(s, r, shear, {0, 0, 0, -r / j}, tangent);
  case ReturnPart::cone:
    const double stiffness = shear + c.bulk * c.friction * c.dilation;
    const double by_volume = c.bulk * c.bulk * c.dilation * c.friction / stiffness;
    const double by_radius = c.bulk * c.dilation / stiffness;
    const double mean_by_volume = c.bulk - by_volume;
    return write_deviatoric_tangent<D>(
        s, r, shear, {mean_by_volume, -by_radius, -c.friction * mean_by_volume / j, (c.friction * by_radius - r) / j},
        tangent);
  }
}
} // namespace

double cone_slope(double angle, ConeMatch match)
{
  const double phi = angle * std::numbers::pi / 180, sine = std::sin(phi), tangent = std::tan(phi);
  if (match == ConeMatch::plane_strain)
    return 3 * tangent / std::sqrt(9 + 12 * tangent * tangent);
  return 6 * sine / (std::numbers::sqrt3 * (match == ConeMatch::outer ? 3 - sine : 3 + sine));
}

double cone_strength(double cohesion, double friction_angle, ConeMatch match)
{
  const double phi = friction_angle * std::numbers::pi / 180, sine = std::sin(phi), tangent = std::tan(phi);
  if (match == ConeMatch::plane_strain)
    return 3 * cohesion / std::sqrt(9 + 12 * tangent * tangent);
  return 6 * cohesion * std::cos(phi) / (std::numbers::sqrt3 * (match == ConeMatch::outer ? 3 - sine : 3 + sine));
}

double p_wave_modulus(const DruckerPrager& law) { return p_wave_modulus(elastic_moduli(law.young, law.poisson)); }

template <int D>
BatchReport update(const DruckerPrager& law, const PointBatch<D>& points)
{
  const Cone cone = cone_of(law);
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  if (points.tangent)
    fill_elastic_tangent<D>(cone.moduli, points.size, points.tangent);
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    SymTensor<D> trial = elastic_trial<D>(cone.moduli, points, i);
    if (!is_usable<D>(trial))
    {
      report.failed.push_back(i);
      continue;
    }
    double& separation = points.state[1][i];
    const double closed = close_separation<D>(trial, separation, cone.bulk);
    separation -= closed;
    const SymTensor<D> s = deviator<D>(trial);
    const double p = mean<D>(trial), j = radius<D>(s);
    const Returned returned = return_to_cone(cone, p, j);
    const bool plastic = returned.part != ReturnPart::elastic;
    if (returned.part == ReturnPart::cut_off || returned.part == ReturnPart::corner)
      separation += (p - returned.mean) / cone.bulk;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] = plastic ? (k < 3 ? returned.mean : 0.0) + returned.ratio * s[k] : trial[k];
    points.state[0][i] += (1 - returned.ratio) * j / (std::numbers::sqrt3 * cone.moduli.shear);
    report.plastic += plastic ? 1 : 0;
    if (!points.tangent)
      continue;
    double* const tangent = points.tangent + static_cast<std::size_t>(i) * entries;
    write_tangent<D>(cone, returned, s, j, tangent);
    if (closed > 0 && separation > 0)
      remove_volumetric_part<D>(tangent);
  }
  return report;
}

template BatchReport update<2>(const DruckerPrager&, const PointBatch<2>&);
template BatchReport update<3>(const DruckerPrager&, const PointBatch<3>&);
} // namespace mpm::materials
