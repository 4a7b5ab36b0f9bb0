#include "python/bindings.h"

#include "explicit/run.h"
#include "explicit/two_phase_step.h"

#include <array>
#include <tuple>
#include <vector>

namespace mpm::python
{
namespace
{
namespace py = pybind11;

void bind_geometry(py::module_& m)
{
  enum class Geometry
  {
    plane_strain,
    axisymmetric,
    solid
  };
  py::enum_<Geometry>(m, "Geometry", R"(What a mesh stands for.

PLANE_STRAIN: two dimensions, one metre thick, without strain out of the plane. AXISYMMETRIC: half a section of a body of revolution; x
is the radius from the axis x = 0, y the height along it; masses, volumes, forces and energies are those of one radian. SOLID: three
dimensions.)")
      .value("PLANE_STRAIN", Geometry::plane_strain)
      .value("AXISYMMETRIC", Geometry::axisymmetric)
      .value("SOLID", Geometry::solid);
}

void bind_pore_water(py::module_& m)
{
  using Curves = std::array<std::vector<double>, model::Retention::n_curves>;
  using OneRetention = std::tuple<std::vector<double>, Curves, Curves>;
  m.def("fast_wave_squared", &fast_wave_squared);
  m.attr("laboratory_gravity") = model::laboratory_gravity;
  py::class_<PoreWater>(m, "PoreWater")
      .def(py::init<>())
      .def_readwrite("density", &PoreWater::density)
      .def_readwrite("modulus", &PoreWater::modulus)
      .def_readwrite("kozeny_carman", &PoreWater::kozeny_carman)
      .def_readwrite("suction_limit", &PoreWater::suction_limit)
      .def_readwrite("drained_surface", &PoreWater::drained_surface)
      .def_readwrite("inflow", &PoreWater::inflow)
      .def_readwrite("anisotropy", &PoreWater::anisotropy)
      .def_readwrite("standing", &PoreWater::standing)
      .def_readwrite("rain", &PoreWater::rain)
      .def_property_readonly("may_dry", &PoreWater::may_dry)
      .def("set_retention",
           [](PoreWater& water, const std::vector<OneRetention>& curves)
           {
             water.retention.clear();
             for (const auto& [suction, values, slopes] : curves)
               water.retention.push_back({suction, values, slopes});
           })
      .def("saturation",
           [](const PoreWater& water, const std::vector<Index>& material, const std::vector<double>& pressure)
           {
             std::vector<double> saturation(pressure.size());
             for (std::size_t p = 0; p < pressure.size(); ++p)
               saturation[p] =
                   wetness_at(water.retention[static_cast<std::size_t>(material[p])], pressure[p]).saturation;
             return saturation;
           })
      .def("acting",
           [](const PoreWater& water, const std::vector<Index>& material, std::vector<double> pressure)
           {
             for (std::size_t p = 0; p < pressure.size(); ++p)
               pressure[p] = acting_pressure(water.retention[static_cast<std::size_t>(material[p])], pressure[p]);
             return pressure;
           })
      .def("set_conditions",
           [](PoreWater& water, const std::vector<std::tuple<Index, TimeTable, bool, bool, bool>>& conditions)
           {
             water.conditions.clear();
             for (const auto& [tag, value, is_level, held, presses] : conditions)
               water.conditions.push_back({tag, value, is_level, held, presses});
           });
}

void bind_schemes(py::module_& m)
{
  py::enum_<StressUpdate>(m, "StressUpdate")
      .value("MODIFIED_LAST", StressUpdate::modified_last)
      .value("LAST", StressUpdate::last)
      .value("FIRST", StressUpdate::first);
  py::enum_<Integration>(m, "Integration", R"(How the stresses of a cell become forces at its nodes.

PARTICLES: the sum over its particles, the material point method as it is. MIXED: a cell whose particles have at least 90 % of its
volume integrates their mean stress over its own volume (Al-Kafaji 2013, section 3; Anura3D). DUAL_DOMAIN: gradients of shape
functions that are continuous over the sides of cells (Zhang, Ma & Giguere 2011); explicit scheme only.)")
      .value("PARTICLES", Integration::particles)
      .value("MIXED", Integration::mixed)
      .value("DUAL_DOMAIN", Integration::dual_domain);
  py::enum_<Transfer>(m, "Transfer", R"(Which velocities particles carry from step to step.

FLIP: their own, which change by the increments of the nodes' velocities (18), with ``pic`` a part of these velocities. AFFINE: the
velocity of the nodes at their place, and its gradient (APIC, in linear simplices the same as TPIC): no motion that nodes do not
see; ``pic`` leaves a part of the gradient out.)")
      .value("FLIP", Transfer::flip)
      .value("AFFINE", Transfer::affine);
}
} // namespace

void bind_options(py::module_& m)
{
  bind_geometry(m);
  bind_pore_water(m);
  bind_schemes(m);
  py::class_<ExplicitOptions>(m, "ExplicitOptions")
      .def(py::init<>())
      .def_readwrite("stress_update", &ExplicitOptions::stress_update)
      .def_readwrite("damping", &ExplicitOptions::damping)
      .def_property(
          "rayleigh", // mass, stiffness, plastic strain
          [](const ExplicitOptions& options)
          { return std::tuple(options.rayleigh.mass, options.rayleigh.stiffness, options.rayleigh.plastic_strain); },
          [](ExplicitOptions& options, const std::tuple<double, double, double>& given) {
            options.rayleigh = {std::get<0>(given), std::get<1>(given), std::get<2>(given)};
          })
      .def_readwrite("nmd", &ExplicitOptions::nmd)
      .def_readwrite("moving_cells", &ExplicitOptions::moving_cells)
      .def_readwrite("transfer", &ExplicitOptions::transfer)
      .def_readwrite("integration", &ExplicitOptions::integration)
      .def_readwrite("reproducible", &ExplicitOptions::reproducible);
  py::class_<RunOptions>(m, "RunOptions")
      .def(py::init<>())
      .def_readwrite("until", &RunOptions::until)
      .def_readwrite("dt", &RunOptions::dt)
      .def_readwrite("courant", &RunOptions::courant)
      .def_readwrite("pic", &RunOptions::pic)
      .def_readwrite("allow_unstable", &RunOptions::allow_unstable)
      .def_readwrite("max_steps", &RunOptions::max_steps)
      .def_readwrite("conversion", &RunOptions::conversion);
  py::class_<Conversion>(m, "Conversion")
      .def(py::init(
          [](double plastic_strain, double displacement, int layers) {
            return Conversion{plastic_strain, displacement, layers};
          }));
  m.attr("control_interval") = control_interval;
}
} // namespace mpm::python
