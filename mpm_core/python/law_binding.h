#pragma once
/// @file
/// Laws on NumPy arrays: one row per point.

#include "base/number_text.h"
#include "materials/laws/point_moduli.h"
#include "python/arrays.h"
#include "python/law_arguments.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>

namespace mpm::python
{
/// Points that are transposed at once from NumPy's rows to the law's columns: small enough for the first-level cache.
inline constexpr Index block = 256;

/// What rows of NumPy arrays hold of points. Null where not given.
struct PointRows
{
  const double* strain;
  double *stress, *state, *tangent;
  const double *cell_size, *deformation;
  double time, dt;
};

/// The law on rows of NumPy arrays, in place.
template <int D, class L>
BatchReport update_rows(const L& law, const PointRows& rows, Index size)
{
  constexpr int S = n_stress<D>;
  const int states = n_state(law);
  std::array<std::array<double, block>, S> strain_columns, stress_columns;
  std::array<std::array<double, block>, max_states> state_columns;
  std::array<std::array<double, block>, D * D> deformation_columns;
  PointBatch<D> points;
  std::array<double*, max_states> state_pointers;
  for (int k = 0; k < S; ++k)
  {
    points.strain_increment[k] = strain_columns[k].data();
    points.stress[k] = stress_columns[k].data();
  }
  for (int k = 0; k < states; ++k)
    state_pointers[k] = state_columns[k].data();
  points.state = state_pointers.data();
  points.time = rows.time;
  points.dt = rows.dt;
  for (int k = 0; rows.deformation && k < D * D; ++k)
    points.deformation[k] = deformation_columns[k].data();

  BatchReport total;
  for (Index first = 0; first < size; first += block)
  {
    points.size = std::min(block, size - first);
    for (Index p = 0; p < points.size; ++p)
    {
      const auto row = static_cast<std::size_t>(first + p);
      for (int k = 0; k < S; ++k)
      {
        strain_columns[k][p] = rows.strain[row * S + k];
        stress_columns[k][p] = rows.stress[row * S + k];
      }
      for (int k = 0; k < states; ++k)
        state_columns[k][p] = rows.state[row * states + k];
      for (int k = 0; rows.deformation && k < D * D; ++k)
        deformation_columns[k][p] = rows.deformation[row * D * D + k];
    }
    points.tangent = rows.tangent ? rows.tangent + static_cast<std::size_t>(first) * S * S : nullptr;
    points.cell_size = rows.cell_size ? rows.cell_size + first : nullptr;
    const BatchReport report = update<D>(law, points);
    for (Index p = 0; p < points.size; ++p)
    {
      const auto row = static_cast<std::size_t>(first + p);
      for (int k = 0; k < S; ++k)
        rows.stress[row * S + k] = stress_columns[k][p];
      for (int k = 0; k < states; ++k)
        rows.state[row * states + k] = state_columns[k][p];
    }
    total.plastic += report.plastic;
    for (Index i : report.failed)
      total.failed.push_back(first + i);
  }
  return total;
}

/// The values of an array of a shape, or null for None
inline const double* optional_values(const char* name, const py::object& given,
                                     std::initializer_list<py::ssize_t> shape)
{
  if (given.is_none())
    return nullptr;
  const auto array = py::cast<py::array>(given);
  check_array<double>(name, array, shape);
  return values<double>(array).data();
}

template <class L>
BatchReport update_arrays(const L& law, const py::array& strain_increment, py::array stress, py::array state,
                          const py::object& tangent, double time, double dt, const py::object& cell_size,
                          const py::object& deformation)
{
  const py::ssize_t width = strain_increment.ndim() == 2 ? strain_increment.shape(1) : 0;
  if (width != 4 && width != 6)
    throw InputError("strain_increment has shape " + shape_text(strain_increment) +
                     ", expected (n, 4) in plane strain or (n, 6) in three dimensions");
  const py::ssize_t n = strain_increment.shape(0), dim = width == 4 ? 2 : 3;
  check_array<double>("strain_increment", strain_increment, {n, width});
  check_array<double>("stress", stress, {n, width});
  check_array<double>("state", state, {n, n_state(law)});
  if (!(dt >= 0))
    throw InputError("dt is " + number_text(dt) + " s, expected at least 0 (infinite for slow loading)");
  PointRows rows{};
  if (!tangent.is_none())
  {
    auto array = py::cast<py::array>(tangent);
    check_array<double>("tangent", array, {n, width, width});
    rows.tangent = mutable_values<double>("tangent", array).data();
  }
  rows.strain = values<double>(strain_increment).data();
  rows.stress = mutable_values<double>("stress", stress).data();
  rows.state = mutable_values<double>("state", state).data();
  rows.cell_size = optional_values("cell_size", cell_size, {n});
  rows.deformation = optional_values("deformation", deformation, {n, dim, dim});
  rows.time = time;
  rows.dt = dt;
  py::gil_scoped_release release;
  return width == 4 ? update_rows<2>(law, rows, static_cast<Index>(n))
                    : update_rows<3>(law, rows, static_cast<Index>(n));
}

template <class L>
py::array_t<double> wave_moduli(const L& law, const py::array& stress, const py::array& state)
{
  const py::ssize_t width = stress.ndim() == 2 && stress.shape(1) == 6 ? 6 : 4, n = stress.ndim() ? stress.shape(0) : 0;
  check_array<double>("stress", stress, {n, width});
  check_array<double>("state", state, {n, n_state(law)});
  const Law any = law;
  const double* of_point = values<double>(stress).data();
  auto states = values<double>(state);
  py::array_t<double> moduli({n, py::ssize_t{2}});
  for (py::ssize_t row = 0; row < n; ++row, of_point += width)
  {
    const auto count = static_cast<std::size_t>(n_state(law));
    const WaveModuli here = moduli_of_point(any, (of_point[0] + of_point[1] + of_point[2]) / 3, states.first(count));
    states = states.subspan(count);
    moduli.mutable_at(row, 0) = here.p_wave;
    moduli.mutable_at(row, 1) = here.shear;
  }
  return moduli;
}

inline constexpr const char* update_text =
    R"(Update points by a strain increment, in place; all arrays float64, row by row.

Args:
    strain_increment: engineering shear, shape (n, S) with S = 4 in plane strain or 6.
    stress: at the start [Pa], at the end on return; tension positive, shape (n, S).
    state: state variables, likewise, shape (n, n_state).
    tangent: filled with d stress / d strain [Pa], shape (n, S, S), unless None.
    time: at the start of the increment [s].
    dt: duration of the increment [s]; infinite, as by default, where loading is infinitely slow.
    cell_size: size of each point's cell [m], shape (n,); None where there is no cell.
    deformation: increment of the deformation gradient, 1 + grad u, shape (n, D, D); None for 1 + strain increment.

Returns:
    BatchReport: how many points yielded (plastic) and failed, and the first that failed (-1: none); a point that failed
    is left as it was.)";

/// What every law has in Python. Its parameters are those that it declares; its type is added to the module's list
/// `law_types`.
/// @param with_parts  function of Parts that returns the law with its parts; the numbers are set afterwards
template <class L, class F>
py::class_<L> bind_law(py::module_& m, const std::string& name, const std::string& summary, const std::string& remarks,
                       F with_parts)
{
  const std::vector<Declaration> declared = declarations<L>();
  py::class_<L> type(m, name.c_str(), class_text(declared, summary, remarks).c_str());
  m.attr("law_types").cast<py::list>().append(type);
  type.attr("parameters") = py::tuple(py::cast(declared));
  type.def(py::init([name, with_parts](const py::args& args, const py::kwargs& given)
                    { return constructed<L>(name, with_parts, args, given); }));
  for (const Parameter<L>& parameter : L::parameters())
    type.def_property_readonly(
        std::string(parameter.name).c_str(), [parameter](const L& law) { return parameter.value(law); },
        (std::string(parameter.meaning) + " [" + std::string(parameter.unit) + "]").c_str());
  return type
      .def_property_readonly(
          "name", [](const L& law) { return law_name(law); }, "What the law is called in messages")
      .def_property_readonly(
          "n_state", [](const L& law) { return n_state(law); }, "Number of state variables")
      .def_property_readonly(
          "state_names", [](const L& law) { return state_names(law); },
          "Names of the state variables; the first is plastic_strain, accumulated and deviatoric")
      .def_property_readonly(
          "p_wave_modulus", [](const L& law) { return p_wave_modulus(law); },
          "Modulus of the compression wave, K + 4G/3 [Pa]")
      .def_property_readonly(
          "shear_modulus", [](const L& law) { return shear_modulus(law); },
          "Shear modulus G [Pa]; an estimate of its size where it changes or is not known")
      .def("wave_moduli", &wave_moduli<L>, py::arg("stress"), py::arg("state"),
           "Moduli of compression and shear waves of points as they are now (n, 2) [Pa]; they differ from those of the "
           "law's numbers in `CamClay`, `NorSand`, `Sanisand` and `HardeningSoil`, by the pressure, and in "
           "`Heterogeneous`. Stress (n, S) [Pa], "
           "state (n, n_state).")
      .def_property_readonly(
          "needs_cell_size", [](const L& law) { return needs(law).cell_size; },
          "Whether what the law does depends on the size of a point's cell")
      .def("__repr__", [name](const py::object& law) { return representation<L>(name, law); })
      .def("__eq__",
           [](const L& law, const py::object& other) { return py::isinstance<L>(other) && law == other.cast<L>(); })
      .def("update", &update_arrays<L>, py::arg("strain_increment"), py::arg("stress"), py::arg("state"),
           py::arg("tangent") = py::none(), py::kw_only(), py::arg("time") = 0.0, py::arg("dt") = unlimited,
           py::arg("cell_size") = py::none(), py::arg("deformation") = py::none(), update_text);
}

/// The same for a law of numbers only
template <class L>
py::class_<L> bind_law(py::module_& m, const std::string& name, const std::string& summary,
                       const std::string& remarks = "")
{
  return bind_law<L>(m, name, summary, remarks, [](const Parts&) { return L{}; });
}
} // namespace mpm::python
