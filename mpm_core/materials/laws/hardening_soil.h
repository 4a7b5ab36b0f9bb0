#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// Hardening Soil: a law for sand, gravel and clay with a stiffness that depends on the stress and differs between
/// first loading, unloading and compression.
///
/// With the principal stresses s1 >= s2 >= s3 (positive in compression here), a = c cot(phi) and
/// t = (s3 + a) / (reference pressure + a):
///     elasticity       E_ur = unloading_modulus t^m, constant Poisson's ratio
///     strength         s1 - s3 <= q_f = N (s3 + a), N = 2 sin(phi) / (1 - sin(phi)): that of Mohr and Coulomb
///     shear hardening  gamma = 2 (s1 - s3) / (E_i (1 - R_f (s1 - s3) / q_f)) - 2 (s1 - s3) / E_ur,
///                      E_i = 2 secant_modulus t^m / (2 - R_f): a hyperbola in triaxial compression
///     dilatancy        de_v = -sin(psi_m) dgamma, sin(psi_m) = (sin(phi_m) - sin(phi_cv)) / (1 - sin(phi_m)
///     sin(phi_cv)),
///                      at least 0, with sin(phi_m) = (s1 - s3) / (s1 + s3 + 2 a) and phi_cv so that psi_m is psi at
///                      failure
///     cap              (w q / alpha)^2 + (p + a)^2 = p_p^2, associated, which hardens by
///                      dp_p = H (p_p / (reference pressure + a))^m de_v; w is 1 in triaxial compression and
///                      (3 + sin(phi)) / (3 - sin(phi)) in extension
/// gamma is the sum of the sizes of the principal plastic strains of shear, in triaxial compression 2 e_a - e_v as in
/// the published law, and in plane strain e_1 - e_3. Plastic strains are along the deviator of the stress. alpha and H
/// follow from the oedometer modulus and K0 of normally consolidated ground at the reference pressure.
///
/// An increment is implicit, with the secant of the elastic modulus between the stresses of its start and its end. The
/// equations depend on the Lode angle of the trial deviator, rounded by 0.03 degrees at the edges of the hexagon.
///
/// With a small-strain modulus G0 all elastic moduli are larger while the strain is small since the last reversals, by
/// up to G0 over the shear modulus of unloading, and plastic strains are smaller, by H_i
/// (hardening_soil_small_strain.h).
///
/// Sources: Schanz, Vermeer, Bonnier (1999), The hardening soil model: formulation and verification, Beyond 2000 in
/// Computational Geotechnics, 281-296; Benz (2007), Small-strain stiffness of soils and its numerical consequences,
/// University of Stuttgart, chapter 6.
struct HardeningSoil
{
  double secant_modulus, oedometer_modulus, unloading_modulus, cohesion, friction_angle;
  double dilation_angle = 0, exponent = 0.5, poisson = 0.2, normal_k0 = 0, failure_ratio = 0.9;
  double vertical_preconsolidation = 0, reference_pressure = 100e3;
  double small_strain_modulus = 0, threshold_strain = 2e-4;
  double tension_cutoff = unlimited; ///< without effect from c cot(phi) upwards
  double strength_factor = 1;        ///< what c and tan(phi) are divided by; the cap is that of the full strength

  static constexpr auto parameters()
  {
    using L = HardeningSoil;
    return std::array{
        parameter<L>(
            "secant_modulus", entry<&L::secant_modulus>, "Pa", above<L>(0),
            "E50: secant modulus of a drained triaxial test at half of the strength, at the reference pressure"),
        parameter<L>("oedometer_modulus", entry<&L::oedometer_modulus>, "Pa", above<L>(0),
                     "Eoed: tangent modulus of first loading in the oedometer, at a vertical stress of the reference "
                     "pressure"),
        parameter<L>("unloading_modulus", entry<&L::unloading_modulus>, "Pa",
                     above<L>("secant_modulus", entry<&L::secant_modulus>),
                     "Eur: Young's modulus of unloading and reloading at the reference pressure"),
        parameter<L>("cohesion", entry<&L::cohesion>, "Pa", at_least<L>(0), "cohesion c"),
        parameter<L>("friction_angle", entry<&L::friction_angle>, "degrees", between<L>(0, 90), "friction angle phi"),
        parameter<L>("dilation_angle", entry<&L::dilation_angle>, "degrees",
                     up_to<L>("friction_angle", entry<&L::friction_angle>), "dilation angle psi at failure", 0.0),
        parameter<L>("exponent", entry<&L::exponent>, "-", {{0, true}, {1, true}},
                     "exponent m of the stress by which stiffness grows: 0.5 for sand, up to 1 for clay", 0.5),
        parameter<L>("poisson", entry<&L::poisson>, "-", between<L>(-1, 0.5),
                     "Poisson's ratio of unloading and reloading", 0.2),
        parameter<L>("normal_k0", entry<&L::normal_k0>, "-", {{0, true}, {1, false}},
                     "K0 of normally consolidated soil; 0 stands for 1 - sin(friction_angle)", 0.0),
        parameter<L>("failure_ratio", entry<&L::failure_ratio>, "-", between<L>(0, 1),
                     "failure ratio R_f: strength over the asymptote of the hyperbola", 0.9),
        parameter<L>("vertical_preconsolidation", entry<&L::vertical_preconsolidation>, "Pa", at_least<L>(0),
                     "largest vertical effective stress that level ground has carried before the start; 0 for none",
                     0.0),
        parameter<L>("reference_pressure", entry<&L::reference_pressure>, "Pa", above<L>(0),
                     "stress at which the soil has its moduli", 100e3),
        parameter<L>("small_strain_modulus", entry<&L::small_strain_modulus>, "Pa", at_least<L>(0),
                     "G0: shear modulus at very small strains and the reference pressure; 0 for a law without "
                     "small-strain stiffness",
                     0.0),
        parameter<L>("threshold_strain", entry<&L::threshold_strain>, "-", {{0, false}, {0.01, true}},
                     "gamma_0.7: shear strain at which the secant shear modulus of first loading is 0.722 G0", 2e-4),
        parameter<L>("tension_cutoff", entry<&L::tension_cutoff>, "Pa", or_infinite(at_least<L>(0)),
                     "tension cut-off: largest principal stress; without effect above the apex c cot(phi)", unlimited),
    };
  }

  static constexpr std::string_view name = "HardeningSoil";

  bool operator==(const HardeningSoil&) const = default;
};

/// plastic_strain, shear_hardening (gamma less that of the law's start) and log_preconsolidation (ln of p_p over that
/// of the start). With small-strain stiffness also largest_small_strain and the distances of its bricks, deviators
/// positive in tension, of which plane strain uses three components.
int n_state(const HardeningSoil& law);
std::vector<std::string> state_names(const HardeningSoil& law);
inline Needs needs(const HardeningSoil&) { return {}; }

/// Throws InputError when a parameter is out of its range, or the oedometer modulus cannot be reached with the others.
void check(const HardeningSoil& law);

/// Young's modulus of unloading [Pa] at a smallest principal stress (positive in compression)
double unloading_modulus(const HardeningSoil& law, double stress);

/// The smallest principal stress [Pa], positive in compression
template <int D>
double smallest_stress(const HardeningSoil& law, const SymTensor<D>& stress);

/// c cot(phi) [Pa]
double attraction(const HardeningSoil& law);

/// Modulus of the compression wave, K + 4G/3 [Pa], at the reference pressure: of unloading, or at very small strains
double p_wave_modulus(const HardeningSoil& law);

/// Shear modulus at the reference pressure [Pa]: of unloading, or at very small strains
double shear_modulus(const HardeningSoil& law);

/// The states shear_hardening and log_preconsolidation of a point that has carried its stress, and what the law begins
/// with; for an overconsolidation above 1 also that of normally consolidated ground under so many times its largest
/// principal stress
template <int D>
std::array<double, 2> hardened_to(const HardeningSoil& law, const SymTensor<D>& stress, double overconsolidation);

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the return). A
/// point of which values are not finite fails, and its tangent is zero. Soil that loosens keeps a smallest principal
/// stress of 1e-4 of the reference pressure above the apex.
template <int D>
BatchReport update(const HardeningSoil& law, const PointBatch<D>& points);
} // namespace mpm::materials
