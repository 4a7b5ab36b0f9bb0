#pragma once

#include "materials/laws/mohr_coulomb.h"

namespace mpm::materials
{
/// Viscoplastic Mohr-Coulomb: stresses outside the surface relax back to it in time.
///
/// On a plane of the surface it is Perzyna's law with a linear overstress: the plastic multiplier grows by f /
/// viscosity with the yield function f as a shear stress, so that in steady shear without friction tau = c + viscosity
/// * rate, which is Bingham's fluid. Everywhere, edges and apex included, it is the law of Duvaut and Lions with the
/// relaxation time T that this amounts to:
///     de^vp / dt = C^-1 (sigma - P sigma) / T,    T = viscosity / (G + (lambda + G) sin(phi) sin(psi)),
/// where P sigma is what the law without viscosity returns the stress to. Backward Euler gives
///     sigma = (sigma_trial + a P sigma_trial) / (1 + a),    a = dt / T,
/// exactly, since P of the new stress is P of the trial stress; the tangent is the same mean of the two tangents. An
/// infinite dt gives the law without viscosity, dt = 0 an elastic one.
/// Sources: Perzyna (1966), Adv. Appl. Mech. 9, 243-377; Duvaut, Lions (1972), Les inequations en mecanique et en
/// physique; Simo, Kennedy, Govindjee (1988), IJNME 26, 2161-2185 (why Duvaut-Lions at edges; the update).
struct ViscoplasticMohrCoulomb
{
  MohrCoulomb inviscid; ///< what is left in the limit of slow loading
  double viscosity;

  static constexpr auto parameters()
  {
    using L = ViscoplasticMohrCoulomb;
    constexpr auto soil = MohrCoulomb::parameters_within<L, &L::inviscid>();
    return std::array{soil[0],
                      soil[1],
                      soil[2],
                      soil[3],
                      soil[4],
                      soil[5],
                      parameter<L>("viscosity", entry<&L::viscosity>, "Pa s", above<L>(0),
                                   "shear stress above the strength over the rate of plastic shear strain")};
  }
  static constexpr std::string_view name = "ViscoplasticMohrCoulomb";
  static constexpr std::array state_names = MohrCoulomb::state_names;

  bool operator==(const ViscoplasticMohrCoulomb&) const = default;
};

/// Time T in which the overstress relaxes [s]
double relaxation_time(const ViscoplasticMohrCoulomb& law);

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
inline double p_wave_modulus(const ViscoplasticMohrCoulomb& law) { return p_wave_modulus(law.inviscid); }

inline double shear_modulus(const ViscoplasticMohrCoulomb& law)
{
  return law.inviscid.young / (2 * (1 + law.inviscid.poisson));
}

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the update). A
/// failed point is given the elastic tangent.
template <int D>
BatchReport update(const ViscoplasticMohrCoulomb& law, const PointBatch<D>& points);
} // namespace mpm::materials
