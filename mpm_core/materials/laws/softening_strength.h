#pragma once
/// @file
/// The strength that is left of a softening Mohr-Coulomb soil, and the return of one trial stress to it.

#include "materials/laws/mohr_coulomb_return.h"
#include "materials/laws/softening_mohr_coulomb.h"
#include "materials/tools/branch_free.h"

namespace mpm::materials::mohr_coulomb
{
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
  double per_softening_strain;
  double exponential; ///< 1 for an exponential fall, 0 for a linear one: loops with a choice do not vectorise
};

inline FallingStrength falling_strength(const SofteningMohrCoulomb& law)
{
  constexpr double degree = std::numbers::pi / 180;
  const MohrCoulomb& p = law.peak;
  return {elastic_moduli(p.young, p.poisson),
          p.poisson,
          p.tension_cutoff,
          {p.cohesion, p.cohesion - law.residual_cohesion},
          {p.friction_angle * degree, (p.friction_angle - law.residual_friction_angle) * degree},
          {p.dilation_angle * degree, (p.dilation_angle - law.residual_dilation_angle) * degree},
          1 / law.softening_strain,
          law.shape == Softening::exponential ? 1.0 : 0.0};
}

/// Fraction of what strength can be lost that is lost, by the strain of a band over the softening strain
[[gnu::always_inline]] inline double lost_fraction(double exponential, double progress)
{
  const double linear = progress < 1 ? progress : 1.0;
  return linear + exponential * (1 - falling_exponential(progress) - linear);
}

/// Surface of a point after some strain of its band
[[gnu::always_inline]] inline Surface surface_after(const FallingStrength& s, double band_strain, double deviation)
{
  const double lost = lost_fraction(s.exponential, band_strain * s.per_softening_strain);
  const double factor = deviation > -1 ? 1 + deviation : 0.0;
  const double phi = s.phi.after(lost);
  const Angles angles{short_sine(phi), short_cosine(phi), short_sine(s.psi.after(lost))};
  Surface m = surface(s.moduli, s.poisson, factor * s.cohesion.after(lost), angles, unlimited);
  // Not infinite where the apex comes first: the compiler would turn comparisons with it into branches.
  m.tension = s.tension_cutoff < m.apex ? s.tension_cutoff : std::numeric_limits<double>::max();
  return m;
}

/// A point under a trial stress, whose strength falls with the plastic strain of its return
struct SofteningPoint
{
  const FallingStrength& strength;
  double band_strain;    ///< at the increment's start
  double bands_per_cell; ///< cell size over the reference length
  double cohesion_deviation;
  Principal trial;

  /// Surface after a further plastic strain
  [[gnu::always_inline]] Surface surface_at(double increment) const
  {
    return surface_after(strength, band_strain + bands_per_cell * increment, cohesion_deviation);
  }

  /// Return to the surface that holds after some plastic strain
  template <bool with_cutoff = true>
  [[gnu::always_inline]] Returned returned_at(double increment) const
  {
    return return_to_surface<with_cutoff>(surface_at(increment), trial);
  }

  /// By how much the plastic strain of that return is larger
  double excess_at(double increment) const
  {
    const Surface m = surface_at(increment);
    return deviatoric_plastic_strain(m, trial, return_to_surface(m, trial).stress) - increment;
  }
};
} // namespace mpm::materials::mohr_coulomb
