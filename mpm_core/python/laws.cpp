#include "python/bindings.h"
#include "python/law_binding.h"

namespace mpm::python
{
namespace
{
constexpr double infinity = std::numeric_limits<double>::infinity();

void bind_elastic(py::module_& m)
{
  bind_law<LinearElastic>(m, "LinearElastic")
      .def(py::init([](double young, double poisson) { return checked(LinearElastic{young, poisson}); }),
           py::kw_only(), py::arg("young"), py::arg("poisson"))
      .def_readonly("young", &LinearElastic::young)
      .def_readonly("poisson", &LinearElastic::poisson);
}

void bind_mohr_coulomb(py::module_& m)
{
  bind_law<MohrCoulomb>(m, "MohrCoulomb")
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

void bind_drucker_prager(py::module_& m)
{
  py::enum_<ConeMatch>(m, "ConeMatch")
      .value("OUTER", ConeMatch::outer)
      .value("INNER", ConeMatch::inner)
      .value("PLANE_STRAIN", ConeMatch::plane_strain);
  m.def("cone_slope", &cone_slope, py::arg("angle"), py::arg("match"));
  m.def("cone_strength", &cone_strength, py::arg("cohesion"), py::arg("friction_angle"), py::arg("match"));
  bind_law<DruckerPrager>(m, "DruckerPrager")
      .def(py::init(
               [](double young, double poisson, double strength, double friction, double dilation,
                  std::optional<double> tension_cutoff)
               {
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
} // namespace

void bind_laws(py::module_& m)
{
  py::class_<BatchReport>(m, "BatchReport")
      .def_readonly("plastic", &BatchReport::plastic)
      .def_readonly("failed", &BatchReport::failed)
      .def_readonly("first_failed", &BatchReport::first_failed);
  m.attr("law_types") = py::list();
  bind_elastic(m);
  bind_mohr_coulomb(m);
  bind_drucker_prager(m);
}
} // namespace mpm::python
