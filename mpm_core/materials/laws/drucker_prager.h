#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// Drucker-Prager, linear elastic and perfectly plastic, with non-associated flow and a cut-off of the mean stress.
///
/// With the mean stress p (tension positive) and the second invariant J2 of the deviator a stress is admissible when
///     sqrt(J2) + friction p - strength <= 0   and   p <= tension_cutoff.
/// The flow on the cone is that of the same cone with `dilation` in place of `friction`; the flow on the cut-off is
/// associated. Where the cut-off lies beyond the apex, p = strength / friction, the apex takes its place: a trial
/// stress that the flow does not lead to the cone is returned there. Without friction it is the criterion of von Mises.
/// Soil that has been pulled apart closes again before it carries pressure (tools/separation.h).
/// Source: de Souza Neto, Peric, Owen (2008), Computational Methods for Plasticity, sections 6.4.3 and 8.3.
struct DruckerPrager
{
  double young, poisson, strength;
  double friction = 0, dilation = 0;
  double tension_cutoff = unlimited;

  static constexpr auto parameters()
  {
    using L = DruckerPrager;
    return std::array{
        young_parameter<L>(entry<&L::young>),
        poisson_parameter<L>(entry<&L::poisson>),
        parameter<L>("strength", entry<&L::strength>, "Pa", at_least<L>(0),
                     "sqrt(J2) on the surface at zero mean stress"),
        parameter<L>("friction", entry<&L::friction>, "-", at_least<L>(0),
                     "slope of the surface in p and sqrt(J2); 0 is the criterion of von Mises", 0.0),
        parameter<L>("dilation", entry<&L::dilation>, "-", up_to<L>("friction", entry<&L::friction>),
                     "slope of the plastic potential", 0.0),
        parameter<L>("tension_cutoff", entry<&L::tension_cutoff>, "Pa", or_infinite(at_least<L>(0)),
                     "tension cut-off: largest mean stress; without effect above the apex", unlimited),
    };
  }

  static constexpr std::string_view name = "DruckerPrager";
  static constexpr std::array state_names{"plastic_strain", "separation"};

  bool operator==(const DruckerPrager&) const = default;
};

/// Where a cone meets the pyramid of Mohr-Coulomb
enum class ConeMatch
{
  outer,       ///< on the meridian of triaxial compression
  inner,       ///< on the meridian of triaxial extension
  plane_strain ///< same collapse load in plane strain, exact where the flow is associated
};

/// Slope of the cone that matches a friction (or dilation) angle [degrees]
double cone_slope(double angle, ConeMatch match);

/// sqrt(J2) at zero mean stress on the cone that matches a cohesion [Pa] and friction angle [degrees]
double cone_strength(double cohesion, double friction_angle, ConeMatch match);

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const DruckerPrager& law);

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the return). A
/// failed point is given the elastic tangent.
template <int D>
BatchReport update(const DruckerPrager& law, const PointBatch<D>& points);
} // namespace mpm::materials
