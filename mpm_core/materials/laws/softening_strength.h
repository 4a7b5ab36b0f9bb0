#pragma once
/// @file
/// The strength that is left of a softening Mohr-Coulomb soil, and the return of one trial stress to it.

#include "materials/laws/mohr_coulomb_return.h"
#include "materials/laws/softening_mohr_coulomb.h"
#include "materials/tools/branch_free.h"

namespace mpm::materials::mohr_coulomb
{
/// What falls besides the cohesion: nothing, the friction angle, or the dilation angle too. The less falls, the less
/// there is to compute for each stress.
enum class Falls
{
  cohesion,
  friction,
  dilation
};

/// A quantity that falls from its peak
struct Falling
{
  double peak, fall; ///< peak less residual
  double after(double lost) const { return peak - lost * fall; }
};

/// A softening law with what is the same for all points worked out. Angles in radians
struct FallingStrength
{
  ElasticModuli moduli;
  double poisson, tension_cutoff;
  Falling cohesion, phi, psi;
  Angles peak; ///< of the angles at the peak, which stay where none of them falls
  double per_softening_strain;
  double exponential; ///< 1 for an exponential fall, 0 for a linear one: loops with a choice do not vectorise
};

inline FallingStrength falling_strength(const SofteningMohrCoulomb& law)
{
  constexpr double degree = std::numbers::pi / 180;
  const MohrCoulomb& p = law.peak;
  const double phi = p.friction_angle * degree, psi = p.dilation_angle * degree;
  return {elastic_moduli(p.young, p.poisson),
          p.poisson,
          p.tension_cutoff,
          {p.cohesion, p.cohesion - law.residual_cohesion},
          {phi, (p.friction_angle - law.residual_friction_angle) * degree},
          {psi, (p.dilation_angle - law.residual_dilation_angle) * degree},
          {std::sin(phi), std::cos(phi), std::sin(psi)},
          1 / law.softening_strain,
          law.shape == Softening::exponential ? 1.0 : 0.0};
}

/// Fraction of what strength can be lost that is lost, by the strain of a band over the softening strain
[[gnu::always_inline]] inline double lost_fraction(double exponential, double progress)
{
  const double linear = progress < 1 ? progress : 1.0;
  return linear + exponential * (1 - falling_exponential(progress) - linear);
}

/// Its derivative by that strain over the softening strain
[[gnu::always_inline]] inline double lost_rate(double exponential, double progress, double lost)
{
  const double linear = progress < 1 ? 1.0 : 0.0;
  return linear + exponential * (1 - lost - linear);
}

/// What is left of a point's strength
struct Strength
{
  double lost, factor, cohesion; ///< fraction lost; of the point's cohesion over the law's; cohesion [Pa]
  Angles angles;
};

/// Strength of a point after some strain of its band
template <Falls falls>
[[gnu::always_inline]] inline Strength strength_after(const FallingStrength& s, double band_strain, double deviation)
{
  const double lost = lost_fraction(s.exponential, band_strain * s.per_softening_strain);
  const double factor = deviation > -1 ? 1 + deviation : 0.0;
  Angles angles = s.peak;
  if constexpr (falls != Falls::cohesion)
  {
    const double phi = s.phi.after(lost);
    angles.sin_phi = short_sine(phi);
    angles.cos_phi = short_cosine(phi);
  }
  if constexpr (falls == Falls::dilation)
    angles.sin_psi = short_sine(s.psi.after(lost));
  return {lost, factor, factor * s.cohesion.after(lost), angles};
}

[[gnu::always_inline]] inline Surface surface_of(const FallingStrength& s, const Strength& left)
{
  Surface m = surface(s.moduli, s.poisson, left.cohesion, left.angles, unlimited);
  // Not infinite where the apex comes first: the compiler would turn comparisons with it into branches.
  m.tension = s.tension_cutoff < m.apex ? s.tension_cutoff : std::numeric_limits<double>::max();
  return m;
}

/// Surface of a point after some strain of its band
template <Falls falls>
[[gnu::always_inline]] inline Surface surface_after(const FallingStrength& s, double band_strain, double deviation)
{
  return surface_of(s, strength_after<falls>(s, band_strain, deviation));
}

/// A point under a trial stress, whose strength falls with the plastic strain of its return
struct SofteningPoint
{
  const FallingStrength& strength;
  double band_strain;    ///< at the increment's start
  double bands_per_cell; ///< cell size over the reference length
  double cohesion_deviation;
  Principal trial;

  /// Strength after a further plastic strain
  template <Falls falls>
  [[gnu::always_inline]] Strength strength_at(double increment) const
  {
    return strength_after<falls>(strength, band_strain + bands_per_cell * increment, cohesion_deviation);
  }

  /// Surface after a further plastic strain
  [[gnu::always_inline]] Surface surface_at(double increment) const
  {
    return surface_of(strength, strength_at<Falls::dilation>(increment));
  }

  /// Derivative of the fraction of strength that is lost by the plastic strain, after some of it
  [[gnu::always_inline]] double lost_per_strain(double increment, double lost) const
  {
    const double progress = (band_strain + bands_per_cell * increment) * strength.per_softening_strain;
    return lost_rate(strength.exponential, progress, lost) * bands_per_cell * strength.per_softening_strain;
  }

  /// Return to the surface that holds after some plastic strain
  [[gnu::always_inline]] Returned returned_at(double increment) const
  {
    return return_to_surface(surface_at(increment), trial);
  }

  /// The plastic strain to expect, by that of the return to the surface before the increment: as strength is lost the
  /// surface moves away from the trial stress, and the plastic strain grows in proportion to the distance.
  /// @param stress  returned to that surface
  /// @param first   plastic strain of this return
  template <Falls falls>
  [[gnu::always_inline]] double expected(const Surface& m, const Strength& left, Principal stress, double first) const
  {
    const FallingStrength& s = strength;
    double per_lost = left.factor * s.cohesion.fall * left.angles.cos_phi; // of the yield function, at the stress
    if constexpr (falls != Falls::cohesion)
      per_lost -=
          s.phi.fall * (0.5 * (stress.s1 + stress.s3) * left.angles.cos_phi + left.cohesion * left.angles.sin_phi);
    const double distance = yield(m, trial.s1, trial.s3);
    const double more = distance > 0 ? first * per_lost / distance : 0.0; // plastic strain per fraction lost
    const double tangent = 1 - more * lost_per_strain(0, left.lost);
    return tangent > 0.1 ? first / tangent : first;
  }

  /// By how much the plastic strain of that return is larger
  double excess_at(double increment) const
  {
    const Surface m = surface_at(increment);
    return deviatoric_plastic_strain(m, trial, return_to_surface(m, trial).stress) - increment;
  }
};
} // namespace mpm::materials::mohr_coulomb
