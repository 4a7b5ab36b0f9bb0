#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

#include <string>

namespace mpm::materials
{
/// SANISAND of 2004: a bounding surface law for sand under monotonic and cyclic loading, loose and dense, with one set
/// of parameters.
///
/// With the pressure p = attraction - mean stress (positive in compression), the ratio r = s / p of the deviator to it,
/// the void ratio e and the atmospheric pressure p_at = 101.325 kPa:
///     elasticity           G = G_0 p_at (2.97 - e)^2 / (1 + e) sqrt(p / p_at), constant Poisson's ratio
///     critical state       e_c(p) = e_0 - lambda (p / p_at)^xi, psi = e - e_c(p)
///     yield surface        |r - alpha| = sqrt(2/3) m, with the back stress ratio alpha and n = (r - alpha) / |r -
///     alpha| bounding, dilatancy  sqrt(2/3) (g M exp(-n_b psi) - m) and sqrt(2/3) (g M exp(n_d psi) - m) along n
///     direction            g = 2 c / (1 + c - (1 - c) cos(3 theta)), 1 in triaxial compression, c in extension
///     hardening            d alpha = 2/3 h (alpha_b - alpha) dL, h = b_0 / ((alpha - alpha_in) : n),
///                          b_0 = G_0 h_0 (1 - c_h e) / sqrt(p / p_at)
///     dilatancy            D = A_0 (1 + <z : n>) (alpha_d - alpha) : n
///     fabric               dz = -c_z <-D dL> (z_max n + z)
///     flow                 B n - C (n^2 - 1/3) + D/3, B = 1 + 3/2 (1 - c)/c g cos(3 theta),
///                          C = 3 sqrt(3/2) (1 - c)/c g
/// alpha_in is alpha at the last reversal of loading, where (alpha - alpha_in) : n becomes negative. The flow is
/// written for deviators positive in compression. Beyond the bounding surface h is taken with at least the distance
/// from it, so that the soil softens at a finite rate.
///
/// Source: Dafalias, Manzari (2004), J. Eng. Mech. 130, 622-634; integration: Sloan, Abbo, Sheng (2001), Engineering
/// Computations 18, 121-154.
struct Sanisand
{
  double rigidity, poisson;
  double critical_slope, extension_ratio, critical_void_ratio, critical_compression, critical_exponent;
  double hardening, hardening_void_ratio, bounding_exponent;
  double dilatancy, dilatancy_exponent, fabric_limit, fabric_rate;
  double void_ratio, largest_pressure;
  double yield_size = 0.01, attraction = 0;

  static constexpr double atmospheric_pressure = 101.325e3; ///< p_at [Pa]
  /// Pressure that soil keeps at least, however loose [Pa]
  static constexpr double least_pressure = 1e-4 * atmospheric_pressure;

  static constexpr auto parameters()
  {
    using L = Sanisand;
    return std::array{
        parameter<L>("rigidity", entry<&L::rigidity>, "-", above<L>(0), "elastic constant G_0"),
        poisson_parameter<L>(entry<&L::poisson>),
        parameter<L>("critical_slope", entry<&L::critical_slope>, "-", above<L>(0),
                     "slope M of the critical state line in p and q, in triaxial compression"),
        parameter<L>("extension_ratio", entry<&L::extension_ratio>, "-", half_to_one,
                     "slope of the critical state line in triaxial extension over that in compression, c"),
        parameter<L>("critical_void_ratio", entry<&L::critical_void_ratio>, "-", above<L>(0),
                     "void ratio e_0 of the critical state line at zero pressure"),
        parameter<L>("critical_compression", entry<&L::critical_compression>, "-", at_least<L>(0),
                     "factor lambda of the critical state line"),
        parameter<L>("critical_exponent", entry<&L::critical_exponent>, "-", above<L>(0),
                     "exponent xi of the critical state line"),
        parameter<L>("hardening", entry<&L::hardening>, "-", above<L>(0), "constant h_0 of the plastic modulus"),
        parameter<L>("hardening_void_ratio", entry<&L::hardening_void_ratio>, "-", at_least<L>(0),
                     "constant c_h of the plastic modulus, which falls with 1 - c_h e"),
        parameter<L>("bounding_exponent", entry<&L::bounding_exponent>, "-", at_least<L>(0),
                     "exponent n_b of the bounding surface"),
        parameter<L>("dilatancy", entry<&L::dilatancy>, "-", at_least<L>(0), "constant A_0 of the dilatancy"),
        parameter<L>("dilatancy_exponent", entry<&L::dilatancy_exponent>, "-", at_least<L>(0),
                     "exponent n_d of the dilatancy surface"),
        parameter<L>("fabric_limit", entry<&L::fabric_limit>, "-", at_least<L>(0), "largest fabric z_max"),
        parameter<L>("fabric_rate", entry<&L::fabric_rate>, "-", at_least<L>(0),
                     "rate c_z of the fabric by the plastic dilation"),
        parameter<L>("void_ratio", entry<&L::void_ratio>, "-", above<L>(0), "void ratio at the start"),
        parameter<L>(
            "largest_pressure", entry<&L::largest_pressure>, "Pa", above<L>(0),
            "largest effective pressure that is expected; the time step follows from the stiffness there, or at "
            "twice the present pressure where that is more"),
        parameter<L>("yield_size", entry<&L::yield_size>, "-", above<L>(0),
                     "size m of the yield surface in terms of q / p", 0.01),
        parameter<L>("attraction", entry<&L::attraction>, "Pa", at_least<L>(0),
                     "isotropic tension at which stiffness and strength vanish", 0.0),
    };
  }
  static constexpr Range<Sanisand> half_to_one{{0.5, true}, {1, true}};

  static constexpr std::string_view name = "Sanisand";
  static constexpr Needs special_needs{.deformation = true};

  bool operator==(const Sanisand&) const = default;
};

/// plastic_strain, log_specific_volume (the logarithm of 1 + e over that of the start), then six components each of
/// alpha, alpha_in and z, of which plane strain uses four; these tensors are deviators, positive in tension as stresses
inline constexpr int sanisand_states = 20;
inline int n_state(const Sanisand&) { return sanisand_states; }
std::vector<std::string> state_names(const Sanisand& law);
inline Needs needs(const Sanisand&) { return Sanisand::special_needs; }
void check(const Sanisand& law);

/// Bulk over shear modulus [-]
double bulk_per_shear(const Sanisand& law);

/// Elastic shear modulus [Pa] at a pressure [Pa] (attraction included) and a void ratio
double shear_modulus(const Sanisand& law, double pressure, double void_ratio);

/// Modulus of the compression wave, K + 4G/3 [Pa], at the largest pressure
double p_wave_modulus(const Sanisand& law);

/// Shear modulus at the largest pressure [Pa]
double shear_modulus(const Sanisand& law);

/// Updates stress and state of a batch of points by substeps of controlled error, and fills its tangent where wanted by
/// differences of the same substeps. Points whose values are not finite, or which need too many substeps, fail.
template <int D>
BatchReport update(const Sanisand& law, const PointBatch<D>& points);
} // namespace mpm::materials
