#include "python/bindings.h"
#include "python/law_binding.h"

namespace mpm::python
{
namespace
{
void bind_soils(py::module_& m)
{
  bind_law<LinearElastic>(m, "LinearElastic", "Isotropic linear elasticity in rate form.");
  bind_law<MohrCoulomb>(
      m, "MohrCoulomb",
      "Mohr-Coulomb, linear elastic and perfectly plastic, with non-associated flow and a tension cut-off.");
  bind_law<ViscoplasticMohrCoulomb>(
      m, "ViscoplasticMohrCoulomb",
      "Mohr-Coulomb whose stress may exceed the strength for a while (Perzyna, Duvaut and Lions).",
      R"(The overstress relaxes in relaxation_time, so that in steady shear without friction the shear stress is the
cohesion plus the viscosity times the rate. Quasi-static finite elements without a duration, and Model.equilibrate,
end without overstress.)")
      .def_property_readonly("relaxation_time", &relaxation_time, "Time in which the overstress relaxes [s]");
  bind_law<CamClay>(
      m, "CamClay", "Modified Cam-Clay with pressure-dependent elasticity.",
      R"(The state variable log_preconsolidation is the logarithm of the preconsolidation pressure over its initial
value, attraction included in both; set it for points with another initial value. The time step follows from the
modulus at twice the preconsolidation pressure. Soil that loosens keeps a pressure of 1e-4 of the preconsolidation
pressure of the start, attraction included in both.

With creep no stress is outside of the surface. With p_eq = p + q^2 / (M^2 p) the clay flows all the time, normal to
the ellipse through its stress, by the volumetric strain rate

    creep / (v reference_time) (p_eq / p_c)^((compression - swelling) / creep) (1 - q^2 / (M^2 p^2)),

so that under constant stress its specific volume v falls by creep for each factor e of time, and fast loading meets
more strength: at the same volume by the ratio of the rates to the power creep / compression. Increments without a
duration, as those of stages of construction, are of the law without creep.

Source: Vermeer, Neher (1999), Beyond 2000 in Computational Geotechnics, 249-261; the multiplier is that of
Sivasithamparam, Karstunen, Bonnier (2015), Comput. Geotech. 69, 46-57, for isotropic clay.)");
  bind_law<NorSand>(m, "NorSand",
                    "NorSand: a critical state law for sand, silt and tailings, loose (static liquefaction) or dense.",
                    R"(With p = attraction - mean stress, q = sqrt(3 J2), void ratio e and image pressure p_i:

- critical state: g q = M p and e = e_c(p) = critical_void_ratio - critical_compression ln(p / 1 kPa);
- state parameter: psi_i = e - e_c(p_i);
- yield surface: g q = M_i p (1 + ln(p_i / p)) with M_i = M - coupling dilatancy abs(psi_i), at least M / 2;
- flow: g de_v / de_q = M_i - g q / p, along the deviator of the stress;
- hardening: dp_i / p_i = hardening (p_max / p_i - 1) de_q / g, with p_max = p exp(-dilatancy psi_i / M_i), but at least
  0.37 p; dense sand therefore dilates at the rate dilatancy psi_i / g at most; under isotropic compression, where q = 0, by de_v / M_i for de_q / g;
- direction: g^4 = (1 + b) / 2 - (b - 1) / 2 cos(3 theta) with b = (1 + M / 3)^4 and the Lode angle theta, which is 0 in
  triaxial compression, where g = 1, 60 degrees in triaxial extension, which has the same friction angle, and 30 degrees at
  the critical state in plane strain;
- elasticity: G = rigidity p, and a constant Poisson's ratio.

The state variables log_image_pressure and log_specific_volume are the logarithms of p_i (attraction included) and of
1 + e over their initial values; nor_sand_state gives them for points that begin with a stress and a state parameter. Soil that loosens
keeps a pressure of a millionth of 1 kPa plus the attraction. Increments are implicit, of first order: of some 1e-3 for
errors of a few per cent. The time step follows from the modulus at twice the largest pressure within the yield
surface. Without the softening by rotation of principal stresses and by unloading of later versions.

Source: Jefferies (1993), Geotechnique 43, 91-103; Jefferies, Been (2016), Soil Liquefaction, 2nd ed.; g is that of van
Eekelen (1980), Int. J. Numer. Anal. Methods Geomech. 4, 89-101, and Sheng, Sloan, Yu (2000), Comput. Mech. 26, 185-196.)");
  bind_law<Sanisand>(
      m, "Sanisand", "SANISAND: a bounding surface law for sand under monotonic and cyclic loading, loose and dense.",
      R"(With p = attraction - mean stress, r = s / p, void ratio e and the atmospheric pressure p_at = 101.325 kPa:

- elasticity: G = rigidity p_at (2.97 - e)^2 / (1 + e) sqrt(p / p_at), and a constant Poisson's ratio;
- critical state: q = g M p and e_c(p) = critical_void_ratio - critical_compression (p / p_at)^critical_exponent, with
  g = 2 c / (1 + c - (1 - c) cos(3 theta)) and c = extension_ratio; psi = e - e_c(p);
- yield surface: a narrow cone, abs(r - alpha) = sqrt(2/3) yield_size, along n = (r - alpha) / abs(r - alpha);
- bounding surface g M exp(-bounding_exponent psi) and dilatancy surface g M exp(dilatancy_exponent psi), in q / p;
- hardening: in proportion to the distance from the bounding surface and to
  rigidity hardening (1 - hardening_void_ratio e) / sqrt(p / p_at) over the distance from the last reversal of loading;
- dilatancy: dilatancy (1 + <z : n>) times the distance from the dilatancy surface; the fabric z develops by
  fabric_rate (fabric_limit n + z) with plastic dilation and makes sand contract after its next reversal.

The state variable log_specific_volume is the logarithm of 1 + e over its initial value; the others are the back stress
ratio alpha, alpha at the last reversal, and z, as deviators positive in tension; sanisand_state gives them for points
that begin with a stress and a state parameter. Soil that has never been loaded begins with the ratio of its stress.
Soil keeps a pressure of 10 Pa however loose, and the stiffness of the void ratio 2 beyond it. The law is integrated in
substeps with an error of 1e-5, so that large and small increments give the same. The time step follows from the
stiffness at largest_pressure, or at twice the present pressure where that is more.

Parameters of Toyoura sand: rigidity 125, poisson 0.05, critical_slope 1.25, extension_ratio 0.712, critical_void_ratio
0.934, critical_compression 0.019, critical_exponent 0.7, hardening 7.05, hardening_void_ratio 0.968, bounding_exponent
1.1, dilatancy 0.704, dilatancy_exponent 3.5, fabric_limit 4, fabric_rate 600.

Source: Dafalias, Manzari (2004), J. Eng. Mech. 130, 622-634.)")
      .attr("atmospheric_pressure") = Sanisand::atmospheric_pressure;
}

/// Rows of shear_hardening and log_preconsolidation
template <int D>
py::array_t<double> hardened_rows(const HardeningSoil& law, std::span<const double> stress, py::ssize_t n,
                                  double overconsolidation)
{
  py::array_t<double> states({n, py::ssize_t{2}});
  for (py::ssize_t row = 0; row < n; ++row)
  {
    SymTensor<D> of_point;
    std::copy_n(stress.begin() + row * n_stress<D>, n_stress<D>, of_point.begin());
    const auto [shear, cap] = hardened_to<D>(law, of_point, overconsolidation);
    states.mutable_at(row, 0) = shear;
    states.mutable_at(row, 1) = cap;
  }
  return states;
}

void bind_hardening_soil(py::module_& m)
{
  bind_law<HardeningSoil>(
      m, "HardeningSoil",
      "Hardening Soil: stiffness by stress, in first loading, unloading and compression, for sand, gravel and clay.",
      R"(With the principal stresses s1 >= s2 >= s3 (positive in compression here), a = c cot(phi) and
t = (s3 + a) / (reference_pressure + a):

- elasticity of unloading and reloading: E_ur = unloading_modulus t^exponent, and a constant Poisson's ratio;
- strength: that of Mohr and Coulomb;
- first loading in shear: in a drained triaxial test the axial strain is a hyperbola of s1 - s3, with the secant modulus
  secant_modulus t^exponent at half of the strength and its asymptote at the strength over failure_ratio;
- dilatancy: by Rowe (1962) with dilation_angle at failure; soil does not contract by shear alone;
- compression: an elliptic cap around the pressures that the soil has carried, with associated flow, which gives the
  oedometer_modulus and normal_k0 in the oedometer at the reference pressure.

The state variables are shear_hardening, the hardening shear strain less that of the start, and log_preconsolidation, the
logarithm of the size of the cap over that of the start. Ground that is loaded from zero stress by its weight is
normally consolidated, or less where vertical_preconsolidation is given, and so are points that begin with stresses;
hardening_soil_state gives the states of overconsolidated ones. Increments are implicit, with elastic moduli that are secants between the stresses of start and end. The
direction of plastic strains is that of the deviator of the stress.

With a small_strain_modulus G0 the soil is stiffer while the strain since its last reversals is small, as of the HS-Brick
law: G = G0 / (1 + 0.385 gamma / threshold_strain) in first loading, with gamma = e_1 - e_3 in triaxial directions (in
simple shear sqrt(3)/2 of the engineering strain), until the tangent modulus is that of unloading; Masing's rule in
unloading and reloading; the same Poisson's ratio; and plastic strains that are smaller by
H_i = (G / G_ur)^(1 + E_ur / (2 E50)), where G is the smallest tangent modulus of the history. A small cycle leaves no
trace. The states are then largest_small_strain and the distances of ten bricks that the strain drags along by strings,
which are not turned with the soil: strains that turn it by much have long used them up.

Source: Schanz, Vermeer, Bonnier (1999), Beyond 2000 in Computational Geotechnics, 281-296; Benz (2007), Small-strain
stiffness of soils and its numerical consequences, University of Stuttgart, chapter 6; Cudny, Truty (2020), Acta
Geotechnica 15, 2031-2051.)")
      .def_readonly("strength_factor", &HardeningSoil::strength_factor, "What the strength is divided by");
  m.def(
      "hardened_to",
      [](const HardeningSoil& law, const py::array& stress, double overconsolidation)
      {
        const py::ssize_t n = stress.shape(0), width = stress.shape(1);
        check_array<double>("stress", stress, {n, width});
        const auto values_of = values<double>(stress);
        return width == 4 ? hardened_rows<2>(law, values_of, n, overconsolidation)
                          : hardened_rows<3>(law, values_of, n, overconsolidation);
      },
      py::arg("law"), py::arg("stress"), py::arg("overconsolidation"));
}

void bind_hoek_brown(py::module_& m)
{
  bind_law<HoekBrown>(
      m, "HoekBrown", "Rock mass by the criterion of Hoek and Brown, linear elastic and perfectly plastic.",
      R"(With the principal stresses S1 >= S2 >= S3 (positive in compression here) a stress is admissible when

    S1 - S3 <= intact_strength (m_b S3 / intact_strength + s)^a,

where m_b, s and a follow from the geological strength index and the disturbance factor (properties of the law). The
flow is that of the Mohr-Coulomb plane that touches the criterion in the stress at the end of the increment. Divided by
a strength factor, the shear strengths under all normal stresses are smaller by it. The tensile strength is
s intact_strength / m_b, unless tension_cutoff is less.

Sources: Hoek, Carranza-Torres, Corkum (2002), Proc. NARMS-TAC, 267-273 (criterion); Clausen, Damkilde (2008), Int. J.
Rock Mech. Min. Sci. 45, 831-847 (return); Benz, Schwab, Kauther, Vermeer (2008), ibid., 210-222 (strength
reduction).)")
      .def_property_readonly(
          "m_b", [](const HoekBrown& law) { return hoek_brown_constants(law).mb; }, "m_b of the rock mass [-]")
      .def_property_readonly(
          "s", [](const HoekBrown& law) { return hoek_brown_constants(law).s; }, "s [-]")
      .def_property_readonly(
          "a", [](const HoekBrown& law) { return hoek_brown_constants(law).a; }, "a [-]")
      .def_readonly("strength_factor", &HoekBrown::strength_factor, "What the shear strength is divided by");
}
} // namespace

void bind_soil_laws(py::module_& m)
{
  bind_soils(m);
  bind_hardening_soil(m);
  bind_hoek_brown(m);
}
} // namespace mpm::python
