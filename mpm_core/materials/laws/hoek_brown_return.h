#pragma once
/// @file
/// Return of one trial stress to the criterion of Hoek and Brown, in principal stresses.
///
/// In the plane of the largest and the smallest principal stress the criterion is a curve without corners, convex
/// towards the outside. Near a point of it the curve is its tangent, a Mohr-Coulomb criterion. So Newton's method for
/// the point at which a return ends is to return to the tangent at the last point again and again, whatever region of
/// the pyramid the return leads to: plane, edges, tension cut-off. Points of the curve are named by
///     y = mb S3 / intact_strength + s,
/// which is zero at the tensile strength; S3 is the smallest principal stress, positive in compression, of the
/// criterion before its strength is divided by a factor. The divided criterion is touched by the Mohr-Coulomb criteria
/// whose cohesion and tan(friction angle) are divided.
///
/// Sources: Clausen, Damkilde (2008), Int. J. Rock Mech. Min. Sci. 45, 831-847; Balmer (1952), Proc. ASTM 52, 1260-1271
/// (shear and normal stress on the envelope); Benz, Schwab, Kauther, Vermeer (2008), IJRMMS 45, 210-222.

#include "materials/laws/hoek_brown.h"
#include "materials/laws/mohr_coulomb_tangent.h"

namespace mpm::materials::hoek_brown
{
using mohr_coulomb::Principal;
using mohr_coulomb::Region;
using mohr_coulomb::Returned;
using mohr_coulomb::Surface;

/// The criterion with what its returns need
struct Criterion
{
  ElasticModuli moduli;
  double poisson;
  double intact_strength; ///< [Pa]
  double mb, s, a;
  double factor, dilation_ratio;
  double tension; ///< largest principal stress [Pa]: the cut-off, or just below the tensile strength
  double y_least; ///< where the smallest principal stress on the criterion is the tension
};

Criterion criterion(const HoekBrown& law);

/// The Mohr-Coulomb criterion that touches the divided criterion in a point
struct Tangent
{
  double cohesion;
  mohr_coulomb::Angles angles;
  double size;        ///< of the stresses in the point [Pa]
  double touch;       ///< largest principal stress (tension positive) in the point [Pa]
  double touch_per_y; ///< its derivative by y
  double sin_psi_per_y;
};

inline Tangent tangent_at(const Criterion& c, double y)
{
  const double power = std::pow(y, c.a - 1);
  const double stress = (y - c.s) * c.intact_strength / c.mb; // S3
  const double difference = c.intact_strength * y * power;    // S1 - S3
  const double v = c.a * c.mb * power;                        // its derivative by S3
  const double v_slope = c.a * (c.a - 1) * c.mb * c.mb * power / (y * c.intact_strength);
  const double root = std::sqrt(1 + v);
  // Mohr's envelope: normal and shear stress, and its slope, the tangent of the friction angle
  const double shear = difference * root / (2 + v);
  const double normal = stress + difference / (2 + v);
  const double normal_slope = 1 + v / (2 + v) - difference * v_slope / ((2 + v) * (2 + v));
  const double tan_full = v / (2 * root);
  const double tan_full_slope = v_slope * (2 + v) / (4 * root * root * root);
  const double tan_phi = tan_full / c.factor;
  const double cos_phi = 1 / std::sqrt(1 + tan_phi * tan_phi), sin_phi = tan_phi * cos_phi;
  const double per_y = c.intact_strength / c.mb; // dS3 / dy
  Tangent t;
  t.cohesion = (shear - normal * tan_full) / c.factor;
  t.size = std::abs(normal) + shear;
  t.angles = {sin_phi, cos_phi, c.dilation_ratio * sin_phi};
  // The circle in the point has its centre at normal + shear tan(phi) and the radius shear / cos(phi).
  t.touch = shear / c.factor * cos_phi / (1 + sin_phi) - normal;
  t.touch_per_y = -per_y * (normal_slope / (1 + sin_phi) +
                            shear / c.factor * (tan_full_slope / c.factor) * cos_phi * cos_phi / (1 + sin_phi));
  t.sin_psi_per_y = c.dilation_ratio * cos_phi * cos_phi * cos_phi * tan_full_slope / c.factor * per_y;
  return t;
}

inline Surface surface_of(const Criterion& c, const Tangent& t)
{
  // Of the cohesion only its product with the cosine is used.
  return mohr_coulomb::surface(c.moduli, c.poisson, t.cohesion, t.angles, c.tension);
}

/// Derivative of a returned stress by the sine of the dilation angle, at a fixed trial stress and surface. A turned
/// flow shifts the trial stress by the elastic stress of what the plastic strain changes; where the return to a region
/// does not depend on the trial stress, as at the apex, it changes nothing.
/// @param map  derivative of the returned principal stresses by the trial ones, row by row
Principal change_by_flow(const Surface& m, const mohr_coulomb::Matrix3& map, Principal trial, Returned returned);

/// Where a trial stress was returned to, and the tangent there
struct Solution
{
  Returned returned;
  Surface surface;
  Tangent tangent;
  bool converged;
};

/// Return of a trial stress, which is elastic where it is admissible.
Solution return_to_criterion(const Criterion& c, Principal trial);
} // namespace mpm::materials::hoek_brown
