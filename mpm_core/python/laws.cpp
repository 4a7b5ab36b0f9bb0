#include "materials/laws/association.h"
#include "materials/laws/stiffness_groups.h"
#include "materials/laws/strength_reduction.h"
#include "mesh/mesh.h"
#include "python/bindings.h"
#include "python/law_binding.h"

namespace mpm::python
{
namespace
{
void bind_softening(py::module_& m)
{
  py::enum_<Softening>(m, "Softening").value("LINEAR", Softening::linear).value("EXPONENTIAL", Softening::exponential);
  using L = SofteningMohrCoulomb;
  const auto with_parts = [](const Parts& parts)
  {
    L law{parts.get<MohrCoulomb>("peak", "a MohrCoulomb law"), 0, 0, 0, 0, 0};
    law.shape = parts.get<Softening>("shape", "Softening.EXPONENTIAL or LINEAR", Softening::exponential);
    return law;
  };
  bind_law<L>(
      m, "SofteningMohrCoulomb", "Mohr-Coulomb whose strength falls with the accumulated plastic deviatoric strain.",
      R"(In a cell of size h the strength falls over softening_strain * reference_length / h, so that the energy that
a band dissipates does not depend on the mesh. The state band_strain is the plastic strain that a band as wide as
reference_length would have; the strength follows from it. The state cohesion_deviation is the relative deviation of a
point's cohesion from the law's.)",
      with_parts)
      .def("softened", &softened, py::arg("band_strain"), py::arg("cohesion_deviation") = 0.0,
           "The perfectly plastic law that holds at some states")
      .def_readonly("peak", &L::peak)
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
  bind_law<DruckerPrager>(m, "DruckerPrager",
                          "Drucker-Prager, linear elastic and perfectly plastic: sqrt(J2) + friction * p <= strength "
                          "with the mean stress p.",
                          "See also matched_drucker_prager and von_mises.");
}

/// Throws InputError for the first point whose parameters are out of their range.
/// @param differences  of the parameters that vary, shape (n, number of them)
void check_points(const Heterogeneous& law, const py::array_t<double>& differences)
{
  const auto rows = differences.unchecked<2>();
  std::vector<double> here(law.varying.size());
  for (py::ssize_t i = 0; i < rows.shape(0); ++i)
  {
    for (std::size_t k = 0; k < here.size(); ++k)
      here[k] = rows(i, static_cast<py::ssize_t>(k));
    const LawList<> point = law_of_point(law, here);
    check(point);
    if (p_wave_modulus(point) > p_wave_modulus(law) * (1 + 1e-12))
      throw InputError("a point has the modulus " + number_text(p_wave_modulus(point)) +
                       " Pa, above that of the law's numbers, " + number_text(p_wave_modulus(law)) +
                       " Pa, which bounds the time step; give the law the largest stiffness");
  }
}

void bind_heterogeneous(py::module_& m)
{
  const auto with_parts = [](const Parts& parts)
  {
    return Heterogeneous{parts.get<LawList<>>("law", "a law, but none made of others"),
                         parts.get<std::vector<std::string>>("varying", "a list of names")};
  };
  bind_law<Heterogeneous>(
      m, "Heterogeneous", "A law of which some parameters differ from point to point.",
      R"(Each parameter that varies has a state variable NAME_difference: the value of a point less that of the law.
Set the values by Model.set_parameter, and in finite elements by QuasiStatic.set_parameter. No point may be stiffer
than the values of the law, since these limit the time step.)",
      with_parts)
      .def_readonly("law", &Heterogeneous::law)
      .def_readonly("varying", &Heterogeneous::varying)
      .def_readonly("strength_factor", &Heterogeneous::strength_factor, "What the strength of all points is divided by")
      .def("check_points", &check_points, py::arg("differences"));
}

void bind_wrappers(py::module_& m)
{
  bind_law<Hencky>(m, "Hencky",
                   "A law between Kirchhoff stress and logarithmic strain, for strains that are not small.",
                   "The state variable log_volume is the logarithm of the volume over the initial volume.",
                   [](const Parts& parts) {
                     return Hencky{parts.get<LawList<Heterogeneous>>("law", "a law, but neither Hencky nor Undrained")};
                   })
      .def_readonly("law", &Hencky::law);
  bind_law<Undrained>(
      m, "Undrained", "A saturated soil that does not drain, in effective stresses.",
      R"(The stress of points is the total stress. The state variable excess_pore_pressure [Pa], positive in
compression, is the effective less the total stress (tension positive). A steady pore pressure is not part of these
stresses.)",
      [](const Parts& parts) {
        return Undrained{parts.get<LawList<Heterogeneous, Hencky>>("skeleton", "a law, but not Undrained"), 0, 0};
      })
      .def_readonly("skeleton", &Undrained::skeleton);
}

/// SHA-256 of a file, in hexadecimal digits.
std::string file_hash(const std::string& path)
{
  const py::object hash = py::module_::import("hashlib").attr("sha256");
  return hash(py::module_::import("pathlib").attr("Path")(path).attr("read_bytes")())
      .attr("hexdigest")()
      .cast<std::string>();
}

/// The PROPS that are the strength of a UMAT, in the order in which they are named
std::vector<std::pair<int, StrengthKind>> strength_of(const Parts& parts)
{
  using Named = std::vector<std::pair<int, std::string>>;
  std::vector<std::pair<int, StrengthKind>> strength;
  if (!parts.values.contains("strength_parameters"))
    return strength;
  const py::object given = parts.values["strength_parameters"];
  const py::object items = py::isinstance<py::dict>(given) ? py::list(given.attr("items")()) : given;
  try
  {
    for (const auto& [number, kind] : items.cast<Named>())
      strength.emplace_back(number, strength_kind(kind));
  }
  catch (const py::cast_error&)
  {
    refuse_argument(parts.law, "strength_parameters", given,
                    "a dictionary of numbers of properties, from one, and what they stand for");
  }
  return strength;
}

Umat loaded_umat(const Parts& parts)
{
  const auto symbol = parts.get<std::string>("symbol", "a text", "umat_");
  const UmatFunction function = load_umat(parts.get<std::string>("library", "a path as text"), symbol);
  return {function,
          parts.get<std::vector<double>>("properties", "a list of numbers"),
          parts.get<int>("n_variables", "a whole number"),
          parts.get<int>("plastic_strain_variable", "a whole number", 0),
          0,
          symbol + " of " + file_hash(library_file(function)),
          strength_of(parts)};
}

void bind_umat(py::module_& m)
{
  bind_law<Umat>(
      m, "Umat", "A law given as an Abaqus UMAT in a shared library.",
      R"(NDI is 3, NSHR 1 in plane strain and 3 in three dimensions. TIME, DTIME, CELENT, DFGRD0 and DFGRD1 have the
values of the point; DTIME is one where loading is infinitely slow, CELENT is one where there is no cell. STRESS and
STRAN have been rotated with the material; DROT is this rotation, by which the UMAT rotates tensors in STATEV. Temperature is
not supported. PNEWDT below one counts as a failure.)",
      &loaded_umat)
      .def_readonly("properties", &Umat::properties, "PROPS")
      .def_readonly("n_variables", &Umat::n_variables, "NSTATV")
      .def_readonly("plastic_strain_variable", &Umat::plastic_strain_variable,
                    "Number, from one, of the STATEV with the accumulated plastic deviatoric strain; 0 for none")
      .def_readonly("code", &Umat::code, "Symbol and SHA-256 of the library's file")
      .def_property_readonly(
          "library", [](const Umat& law) { return library_file(law.function); }, "Path of the shared library")
      .def_property_readonly(
          "symbol", [](const Umat& law) { return law.code.substr(0, law.code.find(" of ")); },
          "Name of the subroutine in the library")
      .def_property_readonly(
          "strength_parameters",
          [](const Umat& law)
          {
            py::dict named;
            for (const auto& [number, kind] : law.strength)
              named[py::int_(number)] = strength_kinds[static_cast<std::size_t>(kind)];
            return named;
          },
          "What the PROPS are that a factor of safety divides, by their numbers from one");
}

void bind_declaration(py::module_& m)
{
  py::class_<Declaration>(m, "LawParameter", "A parameter of a law, as the law declares it.")
      .def("__repr__",
           [](py::object p)
           {
             return py::str("<LawParameter: {} [{}], {}, {}>")
                 .format(p.attr("name"), p.attr("unit"), p.attr("meaning"), p.attr("range"));
           })
      .def_readonly("name", &Declaration::name)
      .def_readonly("unit", &Declaration::unit, "\"-\" without unit; None for a part that is no real number")
      .def_readonly("meaning", &Declaration::meaning)
      .def_readonly("range", &Declaration::range, "Allowed values, in words")
      .def_readonly("needed", &Declaration::needed, "Whether it must be given")
      .def_readonly("default", &Declaration::standard, "None where it must be given, or where there is no limit then")
      .def_readonly("lower", &Declaration::lower, "None where there is none, or where it is another parameter")
      .def_readonly("upper", &Declaration::upper, "The same")
      .def_readonly("lower_included", &Declaration::lower_included, "Whether it may be equal to the bound")
      .def_readonly("upper_included", &Declaration::upper_included);
}
} // namespace

void bind_laws(py::module_& m)
{
  py::class_<BatchReport>(m, "BatchReport")
      .def_readonly("plastic", &BatchReport::plastic)
      .def_property_readonly("failed", [](const BatchReport& report) { return report.failed.size(); })
      .def_property_readonly("first_failed", [](const BatchReport& report)
                             { return report.failed.empty() ? -1 : report.failed.front(); });
  bind_declaration(m);
  m.attr("law_types") = py::list();
  bind_soil_laws(m);
  bind_softening(m);
  bind_drucker_prager(m);
  bind_python_law(m);
  bind_umat(m);
  bind_heterogeneous(m);
  bind_wrappers(m);
  m.def(
      "reduced_strength", [](const Law& law, double factor) { return reduced_strength(law, factor); }, py::arg("law"),
      py::arg("factor"));
  m.def(
      "associated_fraction", [](const Law& law) { return associated_fraction(law); }, py::arg("law"));
  m.def(
      "fraction_of_averages", [](const Law& law) { return fraction_of_averages(law); }, py::arg("law"));
  m.def(
      "fraction_of_averaged_forces", [](const Law& law) { return fraction_of_averaged_forces(law); }, py::arg("law"));
  m.def(
      "stiffness_groups", [](const std::vector<Law>& laws) { return stiffness_groups(laws); }, py::arg("laws"));
  m.def("cell_sizes",
        py::vectorize([](double volume, int dim) { return dim == 2 ? cell_size<2>(volume) : cell_size<3>(volume); }),
        py::arg("volumes"), py::arg("dim"));
}
} // namespace mpm::python
