#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// NorSand: a critical state law for sand, silt and tailings, loose or dense.
///
/// With the pressure p = attraction - mean stress (positive in compression), q = sqrt(3 J2), the image pressure p_i and
/// the void ratio e:
///     critical state line  e_c(p) = gamma - lambda ln(p / 1 kPa), g q = M p
///     state parameter      psi_i = e - e_c(p_i)
///     yield surface        g q = M_i p (1 + ln(p_i / p)), M_i = M - N chi |psi_i|, at least M / 2
///     flow                 g D = M_i - g q / p, D = de_v^p / de_q^p; along the deviator of the stress
///     hardening            dp_i / p_i = H (p_max / p_i - 1) dm, p_max = p exp(-chi psi_i / M_i), at least p / e
/// M is the slope in triaxial compression, M / g that in another direction of the deviatoric plane. With the Lode angle
/// theta, 0 in compression and 60 degrees in extension,
///     g^4 = (1 + b) / 2 - (b - 1) / 2 cos(3 theta), b = (1 + M / 3)^4
/// so that the friction angle of extension is that of compression. dm is de_q^p / g; where the surface meets the axis,
/// q = 0 and p = e p_i (there e is Euler's number), it is de_v^p / M_i, so that sand hardens under isotropic
/// compression too. Since g q / p = M_i - chi psi_i where p_i = p_max, dense sand dilates at most by D = chi psi_i / g.
/// Elasticity has the shear modulus G = I_r p and a constant Poisson's ratio. All of it is taken at the end of each
/// increment.
///
/// This is the law of 1993 with M_i as in the book of 2016. M_i / g and dm are the book's as well: its M_i in other
/// directions than that of compression, and its factor M_i / M_itc of the hardening. The other factor of its hardening,
/// its softening by the rotation of principal stresses and its yielding in unloading are left out. The book has
/// 1 / g = 1 - M / (3 + M) sin(3 theta / 2), which is the same in extension and differs by 3.3 % at most between (M
/// from 1 to 1.8), but has an edge in compression, where ground at rest is, and is not convex in extension for M above
/// 4 / 3. The g above is smooth, convex for M up to 1.9, and within 1 % of that of Matsuoka and Nakai for M up to 1.6.
///
/// Source: Jefferies (1993), Geotechnique 43, 91-103; Jefferies, Been (2016), Soil Liquefaction, 2nd ed., chapter 3 and
/// appendix C; Jefferies, Shuttle (2011), Geotechnique 61, 709-713; g: van Eekelen (1980), Int. J. Numer. Anal. Methods
/// Geomech. 4, 89-101; Sheng, Sloan, Yu (2000), Comput. Mech. 26, 185-196.
struct NorSand
{
  double critical_void_ratio, critical_compression, critical_slope, dilatancy, hardening, rigidity, poisson;
  double image_pressure, void_ratio;
  double coupling = 0.2, attraction = 0;

  static constexpr double reference_pressure = 1e3; ///< of the critical state line [Pa]

  static constexpr auto parameters()
  {
    using L = NorSand;
    return std::array{
        parameter<L>("critical_void_ratio", entry<&L::critical_void_ratio>, "-", above<L>(0),
                     "void ratio gamma of the critical state line at 1 kPa"),
        parameter<L>("critical_compression", entry<&L::critical_compression>, "-", above<L>(0),
                     "slope lambda of the critical state line in void ratio and ln p; that in log10 p over 2.303"),
        parameter<L>("critical_slope", entry<&L::critical_slope>, "-", above<L>(0),
                     "slope M of the critical state line in p and q, in triaxial compression"),
        parameter<L>("dilatancy", entry<&L::dilatancy>, "-", at_least<L>(0),
                     "dilatancy chi: the largest rate of dilation over the state parameter psi_i"),
        parameter<L>("hardening", entry<&L::hardening>, "-", above<L>(0), "hardening H"),
        parameter<L>("rigidity", entry<&L::rigidity>, "-", above<L>(0), "shear modulus over the pressure, I_r"),
        poisson_parameter<L>(entry<&L::poisson>),
        parameter<L>("image_pressure", entry<&L::image_pressure>, "Pa", above<L>(0),
                     "image pressure at the start, less the attraction"),
        parameter<L>("void_ratio", entry<&L::void_ratio>, "-", above<L>(0), "void ratio at the start"),
        parameter<L>("coupling", entry<&L::coupling>, "-", at_least<L>(0),
                     "volumetric coupling N: how much the slope of the image state falls off the critical state", 0.2),
        parameter<L>("attraction", entry<&L::attraction>, "Pa", at_least<L>(0),
                     "isotropic tension at which stiffness and strength vanish; with 0 a point at zero pressure "
                     "has no stiffness, and its update fails",
                     0.0),
    };
  }

  static constexpr std::string_view name = "NorSand";
  /// `log_image_pressure` is ln of p_i over that of the law's start, `log_specific_volume` ln of the specific volume
  /// over that of the start; both are set by the user for points that begin with other ones.
  static constexpr std::array state_names{"plastic_strain", "log_image_pressure", "log_specific_volume"};

  bool operator==(const NorSand&) const = default;
};

/// Bulk modulus over the pressure [-]
double bulk_per_pressure(const NorSand& law);

/// Modulus of the compression wave, K + 4G/3 [Pa], at twice the largest pressure within the yield surface of the start
double p_wave_modulus(const NorSand& law);

/// Shear modulus at the image pressure of the start [Pa]
double shear_modulus(const NorSand& law);

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the return). A
/// point without pressure, of which values are not finite, or whose increment is too large for a return fails, and its
/// tangent is zero. Soil that loosens keeps a pressure of at least a millionth of 1 kPa and the attraction, without
/// shear stress, from which it can close again.
template <int D>
BatchReport update(const NorSand& law, const PointBatch<D>& points);
} // namespace mpm::materials
