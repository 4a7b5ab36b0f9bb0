#include "python/bindings.h"
#include "python/law_binding.h"

#include <limits>

namespace mpm::python
{
namespace
{
constexpr double infinity = std::numeric_limits<double>::infinity();

void bind_elastic(py::module_& m)
{
  bind_law<LinearElastic>(m, "LinearElastic", R"(Isotropic linear elasticity in rate form.

Args:
    young: Young's modulus [Pa], positive.
    poisson: Poisson's ratio [-], in (-1, 0.5).)")
      .def(py::init(
               [](double young, double poisson) {
                 return checked(LinearElastic{young, poisson});
               }),
           py::kw_only(), py::arg("young"), py::arg("poisson"))
      .def_readonly("young", &LinearElastic::young)
      .def_readonly("poisson", &LinearElastic::poisson);
}

void bind_mohr_coulomb(py::module_& m)
{
  bind_law<MohrCoulomb>(
      m, "MohrCoulomb",
      R"(Mohr-Coulomb, linear elastic and perfectly plastic, with non-associated flow and a tension cut-off.

Args:
    young: Young's modulus [Pa], positive.
    poisson: Poisson's ratio [-], in (-1, 0.5).
    cohesion: [Pa], at least 0.
    friction_angle: [degrees], in [0, 90).
    dilation_angle: [degrees], in [0, friction_angle].
    tension_cutoff: largest principal stress [Pa], at least 0; by default the apex.)")
      .def(py::init(
               [](double young, double poisson, double cohesion, double friction_angle, double dilation_angle,
                  std::optional<double> tension_cutoff)
               {
                 return checked(MohrCoulomb{young, poisson, cohesion, friction_angle, dilation_angle,
                                            tension_cutoff.value_or(infinity)});
               }),
           py::kw_only(), py::arg("young"), py::arg("poisson"), py::arg("cohesion"), py::arg("friction_angle"),
           py::arg("dilation_angle") = 0.0, py::arg("tension_cutoff") = py::none())
      .def_readonly("young", &MohrCoulomb::young)
      .def_readonly("poisson", &MohrCoulomb::poisson)
      .def_readonly("cohesion", &MohrCoulomb::cohesion)
      .def_readonly("friction_angle", &MohrCoulomb::friction_angle)
      .def_readonly("dilation_angle", &MohrCoulomb::dilation_angle)
      .def_readonly("tension_cutoff", &MohrCoulomb::tension_cutoff);
}

void bind_softening(py::module_& m)
{
  py::enum_<Softening>(m, "Softening").value("LINEAR", Softening::linear).value("EXPONENTIAL", Softening::exponential);
  using L = SofteningMohrCoulomb;
  bind_law<L>(m, "SofteningMohrCoulomb",
              R"(Mohr-Coulomb whose strength falls with the accumulated plastic deviatoric strain.

Args:
    peak: MohrCoulomb law with elasticity, peak strength and tension cut-off.
    residual_cohesion: [Pa], at most that of the peak.
    residual_friction_angle: [degrees], at most that of the peak.
    residual_dilation_angle: [degrees], at most residual_friction_angle.
    softening_strain: plastic strain over which the strength falls in a band as wide as reference_length [-].
    reference_length: [m]. In a cell of size h the strength falls over softening_strain * reference_length / h, so that the
        energy that a band dissipates does not depend on the mesh. Sizes come with the seeding, as the state cell_size.
    shape: Softening.EXPONENTIAL, by exp(-strain / softening_strain), or LINEAR.

The state cohesion_deviation is the relative deviation of a point's cohesion from the law's, for random fields.)")
      .def(py::init(
               [](const MohrCoulomb& peak, double cohesion, double friction_angle, double dilation_angle, double strain,
                  double length, Softening shape) {
                 return checked(L{peak, cohesion, friction_angle, dilation_angle, strain, length, shape});
               }),
           py::arg("peak"), py::kw_only(), py::arg("residual_cohesion"), py::arg("residual_friction_angle"),
           py::arg("residual_dilation_angle") = 0.0, py::arg("softening_strain"), py::arg("reference_length"),
           py::arg("shape") = Softening::exponential)
      .def("softened", &softened, py::arg("plastic_strain"), py::arg("cell_size") = 0.0,
           py::arg("cohesion_deviation") = 0.0)
      .def_readonly("peak", &L::peak)
      .def_readonly("residual_cohesion", &L::residual_cohesion)
      .def_readonly("residual_friction_angle", &L::residual_friction_angle)
      .def_readonly("residual_dilation_angle", &L::residual_dilation_angle)
      .def_readonly("softening_strain", &L::softening_strain)
      .def_readonly("reference_length", &L::reference_length)
      .def_readonly("shape", &L::shape)
      .def_property_readonly("young", [](const L& law) { return law.peak.young; })
      .def_property_readonly("poisson", [](const L& law) { return law.peak.poisson; });
}

void bind_drucker_prager(py::module_& m)
{
  py::enum_<ConeMatch>(m, "ConeMatch")
      .value("OUTER", ConeMatch::outer)
      .value("INNER", ConeMatch::inner)
      .value("PLANE_STRAIN", ConeMatch::plane_strain);
  m.def("cone_slope", &cone_slope, py::arg("angle"), py::arg("match"));
  m.def("cone_strength", &cone_strength, py::arg("cohesion"), py::arg("friction_angle"), py::arg("match"));
  bind_law<DruckerPrager>(
      m, "DruckerPrager",
      R"(Drucker-Prager, linear elastic and perfectly plastic: sqrt(J2) + friction * p <= strength with the mean stress p.

Args:
    young: Young's modulus [Pa], positive.
    poisson: Poisson's ratio [-], in (-1, 0.5).
    strength: sqrt(J2) on the surface at zero mean stress [Pa], at least 0.
    friction: slope of the surface [-], at least 0; 0 is the criterion of von Mises.
    dilation: slope of the plastic potential [-], in [0, friction].
    tension_cutoff: largest mean stress [Pa], at least 0; by default the apex.

See also matched_drucker_prager and von_mises.)")
      .def(py::init(
               [](double young, double poisson, double strength, double friction, double dilation,
                  std::optional<double> tension_cutoff) {
                 return checked(
                     DruckerPrager{young, poisson, strength, friction, dilation, tension_cutoff.value_or(infinity)});
               }),
           py::kw_only(), py::arg("young"), py::arg("poisson"), py::arg("strength"), py::arg("friction") = 0.0,
           py::arg("dilation") = 0.0, py::arg("tension_cutoff") = py::none())
      .def_readonly("young", &DruckerPrager::young)
      .def_readonly("poisson", &DruckerPrager::poisson)
      .def_readonly("strength", &DruckerPrager::strength)
      .def_readonly("friction", &DruckerPrager::friction)
      .def_readonly("dilation", &DruckerPrager::dilation)
      .def_readonly("tension_cutoff", &DruckerPrager::tension_cutoff);
}

void bind_cam_clay(py::module_& m)
{
  bind_law<CamClay>(m, "CamClay", R"(Modified Cam-Clay with pressure-dependent elasticity.

Args:
    compression: slope lambda of the virgin compression line in specific volume and ln p [-], above swelling.
    swelling: slope kappa of the swelling lines [-], positive.
    critical_slope: slope M of the critical state line in p and q [-], positive.
    poisson: Poisson's ratio [-], in (-1, 0.5).
    preconsolidation: preconsolidation pressure at the start [Pa], positive.
    void_ratio: at the start [-], positive.
    attraction: isotropic tension at which stiffness and strength vanish [Pa], at least 0. Without it a point at zero
        pressure has no stiffness, and its update fails.

The state log_preconsolidation is ln of the preconsolidation pressure over that of the start, attraction included in both:
set it for points that begin with another one. The modulus for the time step is that of twice the preconsolidation.)")
      .def(py::init(
               [](double compression, double swelling, double critical_slope, double poisson, double preconsolidation,
                  double void_ratio, double attraction) {
                 return checked(
                     CamClay{compression, swelling, critical_slope, poisson, preconsolidation, void_ratio, attraction});
               }),
           py::kw_only(), py::arg("compression"), py::arg("swelling"), py::arg("critical_slope"), py::arg("poisson"),
           py::arg("preconsolidation"), py::arg("void_ratio"), py::arg("attraction") = 0.0)
      .def_readonly("compression", &CamClay::compression)
      .def_readonly("swelling", &CamClay::swelling)
      .def_readonly("critical_slope", &CamClay::critical_slope)
      .def_readonly("poisson", &CamClay::poisson)
      .def_readonly("preconsolidation", &CamClay::preconsolidation)
      .def_readonly("void_ratio", &CamClay::void_ratio)
      .def_readonly("attraction", &CamClay::attraction);
}

void bind_wrappers(py::module_& m)
{
  bind_law<Hencky>(m, "Hencky",
                   R"(A law between Kirchhoff stress and logarithmic strain, for strains that are not small.

Args:
    law: any law but Undrained. It works on the Kirchhoff stress; points carry the Cauchy stress.

The state log_volume is ln of the volume over that of the start.)")
      .def(py::init([](const LawList<>& law) { return checked(Hencky{law}); }), py::arg("law"))
      .def_readonly("law", &Hencky::law);
  bind_law<Undrained>(m, "Undrained", R"(A saturated soil that does not drain, in effective stresses.

Args:
    skeleton: law of the effective stress; any.
    water_modulus: bulk modulus of the pore water [Pa], positive.
    porosity: [-], in (0, 1).

Points carry the total stress; the state excess_pore_pressure [Pa], positive in compression, is what the effective stress
exceeds it by (tension positive). Where there is a steady pore pressure, stresses are less that one.)")
      .def(py::init(
               [](const LawList<Hencky>& skeleton, double water_modulus, double porosity) {
                 return checked(Undrained{skeleton, water_modulus, porosity});
               }),
           py::arg("skeleton"), py::kw_only(), py::arg("water_modulus") = 2.2e9, py::arg("porosity"))
      .def_readonly("skeleton", &Undrained::skeleton)
      .def_readonly("water_modulus", &Undrained::water_modulus)
      .def_readonly("porosity", &Undrained::porosity);
}

/// SHA-256 of a file, in hexadecimal digits.
std::string file_hash(const std::string& path)
{
  const py::object hash = py::module_::import("hashlib").attr("sha256");
  return hash(py::module_::import("pathlib").attr("Path")(path).attr("read_bytes")())
      .attr("hexdigest")()
      .cast<std::string>();
}

void bind_umat(py::module_& m)
{
  bind_law<Umat>(m, "Umat", R"(A law given as an Abaqus UMAT in a shared library.

Args:
    library: path of the shared library, such as one made by ``gfortran -shared -fPIC -o umat.so umat.f``.
    properties: PROPS.
    n_variables: NSTATV.
    p_wave_modulus: modulus of the compression wave [Pa], for the critical time step; an upper bound will do.
    plastic_strain_variable: number, from one, of the STATEV with the accumulated plastic deviatoric strain; 0: none.
    symbol: name of the subroutine in the library.

NDI is 3, NSHR 1 in plane strain and 3 in three dimensions. DTIME is one and DROT the identity: the stress has been turned
with the material already. Laws that depend on rate, temperature or the deformation gradient cannot be used. PNEWDT below
one counts as a failure.)")
      .def(py::init(
               [](const std::string& library, std::vector<double> properties, int n_variables, double p_wave_modulus,
                  int plastic_strain_variable, const std::string& symbol)
               {
                 const UmatFunction function = load_umat(library, symbol);
                 return checked(Umat{function, std::move(properties), n_variables, plastic_strain_variable,
                                     p_wave_modulus, symbol + " of " + file_hash(library_file(function))});
               }),
           py::arg("library"), py::kw_only(), py::arg("properties"), py::arg("n_variables"), py::arg("p_wave_modulus"),
           py::arg("plastic_strain_variable") = 0, py::arg("symbol") = "umat_")
      .def_readonly("properties", &Umat::properties)
      .def_readonly("n_variables", &Umat::n_variables)
      .def_readonly("plastic_strain_variable", &Umat::plastic_strain_variable)
      .def_readonly("code", &Umat::code, "Symbol and SHA-256 of the library's file");
}
} // namespace

void bind_laws(py::module_& m)
{
  py::class_<BatchReport>(m, "BatchReport")
      .def_readonly("plastic", &BatchReport::plastic)
      .def_property_readonly("failed", [](const BatchReport& report) { return report.failed.size(); })
      .def_property_readonly("first_failed", [](const BatchReport& report)
                             { return report.failed.empty() ? -1 : report.failed.front(); });
  m.attr("law_types") = py::list();
  bind_elastic(m);
  bind_mohr_coulomb(m);
  bind_softening(m);
  bind_drucker_prager(m);
  bind_cam_clay(m);
  bind_python_law(m);
  bind_umat(m);
  bind_wrappers(m);
}
} // namespace mpm::python
