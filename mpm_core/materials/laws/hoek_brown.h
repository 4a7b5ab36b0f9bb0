#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// Rock mass by the criterion of Hoek and Brown, linear elastic and perfectly plastic, with a tension cut-off.
///
/// With the principal stresses S1 >= S2 >= S3 (positive in compression here) a stress is admissible when
///     S1 - S3 - intact_strength (mb S3 / intact_strength + s)^a <= 0   and   S3 >= -tension_cutoff,
/// where mb, s and a follow from the geological strength index GSI and the disturbance factor D:
///     mb = intact_constant exp((GSI - 100) / (28 - 14 D)),   s = exp((GSI - 100) / (9 - 3 D)),
///     a = 1/2 + (exp(-GSI / 15) - exp(-20/3)) / 6.
/// The flow is that of the Mohr-Coulomb plane that touches the criterion, with dilation_ratio times the sine of its
/// friction angle as the sine of its dilation angle. Divided by a strength factor, shear strengths under all normal
/// stresses are smaller by it. Rock that has been pulled apart closes again before it carries pressure
/// (tools/separation.h).
///
/// Sources: Hoek, Carranza-Torres, Corkum (2002), Hoek-Brown failure criterion - 2002 edition, Proc. NARMS-TAC,
/// 267-273; Clausen, Damkilde (2008), Int. J. Rock Mech. Min. Sci. 45, 831-847 (return to the curved surface); Benz,
/// Schwab, Kauther, Vermeer (2008), ibid., 210-222 (strength reduction).
struct HoekBrown
{
  double young, poisson, intact_strength, geological_strength_index, intact_constant;
  double disturbance_factor = 0, dilation_ratio = 0;
  double tension_cutoff = unlimited; ///< without effect from the tensile strength s intact_strength / mb upwards
  double strength_factor = 1;        ///< what shear strengths are divided by

  static constexpr auto parameters()
  {
    using L = HoekBrown;
    return std::array{
        young_parameter<L>(entry<&L::young>),
        poisson_parameter<L>(entry<&L::poisson>),
        parameter<L>("intact_strength", entry<&L::intact_strength>, "Pa", above<L>(0),
                     "sigma_ci: uniaxial compressive strength of intact rock"),
        parameter<L>("geological_strength_index", entry<&L::geological_strength_index>, "-", {{5, true}, {100, true}},
                     "GSI: 100 for intact rock, 10 to 90 for jointed rock masses"),
        parameter<L>("intact_constant", entry<&L::intact_constant>, "-", {{1, true}, {50, true}},
                     "m_i of intact rock: 4 to 10 for claystone and slate, 25 to 33 for granite"),
        parameter<L>("disturbance_factor", entry<&L::disturbance_factor>, "-", {{0, true}, {1, true}},
                     "D: 0 for rock as it was, 1 for rock disturbed by heavy blasting", 0.0),
        parameter<L>("dilation_ratio", entry<&L::dilation_ratio>, "-", {{0, true}, {1, true}},
                     "sine of the dilation angle over that of the friction angle at the same stress; 1 for associated "
                     "flow",
                     0.0),
        parameter<L>("tension_cutoff", entry<&L::tension_cutoff>, "Pa", or_infinite(at_least<L>(0)),
                     "tension cut-off: largest principal stress; without effect above the tensile strength "
                     "s sigma_ci / m_b",
                     unlimited),
    };
  }

  static constexpr std::string_view name = "HoekBrown";
  static constexpr std::array state_names{"plastic_strain", "separation"};

  bool operator==(const HoekBrown&) const = default;
};

/// The constants of a rock mass [-]
struct HoekBrownConstants
{
  double mb, s, a;
};

HoekBrownConstants hoek_brown_constants(const HoekBrown& law);

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const HoekBrown& law);

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the return). A
/// failed point is given the elastic tangent.
template <int D>
BatchReport update(const HoekBrown& law, const PointBatch<D>& points);
} // namespace mpm::materials
