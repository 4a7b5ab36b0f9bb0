#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// Modified Cam-Clay with pressure-dependent elasticity.
///
/// With the pressure p = attraction - mean stress (positive in compression), q = sqrt(3 J2) and the preconsolidation
/// pressure p_c (attraction included) a stress is admissible when
///     q^2 / M^2 + p (p - p_c) <= 0.
/// The flow is associated; p_c hardens by dp_c / p_c = -v / (compression - swelling) de_v^p. Elasticity has the bulk
/// modulus K = v p / swelling and a constant Poisson's ratio. Over an increment v falls by
/// swelling d(ln p) + (compression - swelling) d(ln p_c), however large it is. Soil that loosens keeps a pressure of
/// 1e-4 p_c of the start.
///
/// With creep mu no stress is inadmissible. With p_eq = p + q^2 / (M^2 p), the size of the ellipse through the stress,
/// soil flows all the time, normal to that ellipse, by
///     de_v^p / dt = mu / (v reference_time) (p_eq / p_c)^((compression - swelling) / mu) (1 - q^2 / (M^2 p^2)),
/// so that under a constant stress v falls by mu for each factor e of time, and p_c is that of tests whose steps last
/// the reference time. An increment without a duration is one of the law without creep.
/// Sources: Roscoe, Burland (1968), Engineering Plasticity, 535-609; Borja (1991), CMAME 92, 343-353 (the implicit
/// return with secant moduli); creep: Vermeer, Neher (1999), Beyond 2000 in Computational Geotechnics, 249-261, with
/// the multiplier of Sivasithamparam, Karstunen, Bonnier (2015), Comput. Geotech. 69, 46-57, in which the critical
/// state is no singularity, for isotropic clay.
struct CamClay
{
  double compression, swelling, critical_slope, poisson, preconsolidation, void_ratio;
  double attraction = 0;
  double creep = 0, reference_time = 86400;

  static constexpr auto parameters()
  {
    using L = CamClay;
    return std::array{
        parameter<L>("compression", entry<&L::compression>, "-", above<L>("swelling", entry<&L::swelling>),
                     "slope lambda of the virgin compression line in specific volume and ln p"),
        parameter<L>("swelling", entry<&L::swelling>, "-", above<L>(0), "slope kappa of the swelling lines"),
        parameter<L>("critical_slope", entry<&L::critical_slope>, "-", above<L>(0),
                     "slope M of the critical state line in p and q"),
        poisson_parameter<L>(entry<&L::poisson>),
        parameter<L>("preconsolidation", entry<&L::preconsolidation>, "Pa", above<L>(0),
                     "preconsolidation pressure at the start, less the attraction"),
        parameter<L>("void_ratio", entry<&L::void_ratio>, "-", above<L>(0), "void ratio at the start"),
        parameter<L>("attraction", entry<&L::attraction>, "Pa", at_least<L>(0),
                     "isotropic tension at which stiffness and strength vanish; with 0 a point at zero pressure "
                     "has no stiffness, and its update fails",
                     0.0),
        parameter<L>("creep", entry<&L::creep>, "-", at_least<L>(0),
                     "slope mu of creep in specific volume and ln t, C_alpha / ln 10; 0 for none", 0.0),
        parameter<L>("reference_time", entry<&L::reference_time>, "s", above<L>(0),
                     "duration of the load steps of the tests that gave the preconsolidation pressure, by default a "
                     "day; without effect where there is no creep",
                     86400.0),
    };
  }

  static constexpr std::string_view name = "CamClay";
  /// `log_preconsolidation` is ln of p_c over that of the law's start, set by the user for points that begin with
  /// another one; `log_volume` is ln of the specific volume over that of the start.
  static constexpr std::array state_names{"plastic_strain", "log_preconsolidation", "log_volume"};

  bool operator==(const CamClay&) const = default;
};

/// Modulus of the compression wave, K + 4G/3 [Pa], at twice the preconsolidation pressure of the start: the stiffness
/// grows with the pressure, and a time step from it holds up to there
double p_wave_modulus(const CamClay& law);

/// Shear modulus at the preconsolidation pressure of the start [Pa]
double shear_modulus(const CamClay& law);

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the return). A
/// point without pressure or of which values are not finite fails, and its tangent is zero.
template <int D>
BatchReport update(const CamClay& law, const PointBatch<D>& points);
} // namespace mpm::materials
