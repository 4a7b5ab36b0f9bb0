#pragma once
/// @file
/// Laws on NumPy arrays: one row per point.

#include "materials/laws/law.h"
#include "python/arrays.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <array>

namespace mpm::python
{
/// Points that are transposed at once from NumPy's rows to the law's columns: small enough for the first-level cache.
inline constexpr Index block = 256;

/// The law on rows of NumPy arrays, in place.
template <int D, class L>
BatchReport update_rows(const L& law, const double* strain, double* stress, double* state, double* tangent, Index size)
{
  constexpr int S = n_stress<D>;
  const int states = n_state(law);
  std::array<std::array<double, block>, S> strain_columns, stress_columns;
  std::array<std::array<double, block>, max_states> state_columns;
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

  BatchReport total;
  for (Index first = 0; first < size; first += block)
  {
    points.size = std::min(block, size - first);
    for (Index p = 0; p < points.size; ++p)
    {
      const auto row = static_cast<std::size_t>(first + p);
      for (int k = 0; k < S; ++k)
      {
        strain_columns[k][p] = strain[row * S + k];
        stress_columns[k][p] = stress[row * S + k];
      }
      for (int k = 0; k < states; ++k)
        state_columns[k][p] = state[row * states + k];
    }
    points.tangent = tangent ? tangent + static_cast<std::size_t>(first) * S * S : nullptr;
    const BatchReport report = update<D>(law, points);
    for (Index p = 0; p < points.size; ++p)
    {
      const auto row = static_cast<std::size_t>(first + p);
      for (int k = 0; k < S; ++k)
        stress[row * S + k] = stress_columns[k][p];
      for (int k = 0; k < states; ++k)
        state[row * states + k] = state_columns[k][p];
    }
    total.plastic += report.plastic;
    for (Index i : report.failed)
      total.failed.push_back(first + i);
  }
  return total;
}

template <class L>
BatchReport update_arrays(const L& law, const py::array& strain_increment, py::array stress, py::array state,
                          const py::object& tangent)
{
  const py::ssize_t width = strain_increment.ndim() == 2 ? strain_increment.shape(1) : 0;
  if (width != 4 && width != 6)
    throw InputError("strain_increment has shape " + shape_text(strain_increment) +
                     ", expected (n, 4) in plane strain or (n, 6) in three dimensions");
  const py::ssize_t n = strain_increment.shape(0);
  check_array<double>("strain_increment", strain_increment, {n, width});
  check_array<double>("stress", stress, {n, width});
  check_array<double>("state", state, {n, n_state(law)});
  double* tangent_data = nullptr;
  if (!tangent.is_none())
  {
    auto array = py::cast<py::array>(tangent);
    check_array<double>("tangent", array, {n, width, width});
    tangent_data = mutable_values<double>("tangent", array).data();
  }
  const double* strain = values<double>(strain_increment).data();
  double* const stress_data = mutable_values<double>("stress", stress).data();
  double* const state_data = mutable_values<double>("state", state).data();
  py::gil_scoped_release release;
  return width == 4 ? update_rows<2>(law, strain, stress_data, state_data, tangent_data, static_cast<Index>(n))
                    : update_rows<3>(law, strain, stress_data, state_data, tangent_data, static_cast<Index>(n));
}

inline constexpr const char* update_text =
    R"(Update points by a strain increment, in place; all arrays float64, row by row.

Args:
    strain_increment: engineering shear, shape (n, S) with S = 4 in plane strain or 6.
    stress: at the start [Pa], at the end on return; tension positive, shape (n, S).
    state: state variables, likewise, shape (n, n_state).
    tangent: filled with d stress / d strain [Pa], shape (n, S, S), unless None.

Returns:
    BatchReport: how many points yielded (plastic) and failed, and the first that failed (-1: none); a point that failed
    is left as it was.)";

/// What every law has in Python, beside its parameters. Its type is added to the module's list `law_types`.
template <class L>
py::class_<L> bind_law(py::module_& m, const char* name, const char* text)
{
  py::class_<L> type(m, name, text);
  m.attr("law_types").cast<py::list>().append(type);
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
      .def("__eq__",
           [](const L& law, const py::object& other) { return py::isinstance<L>(other) && law == other.cast<L>(); })
      .def("update", &update_arrays<L>, py::arg("strain_increment"), py::arg("stress"), py::arg("state"),
           py::arg("tangent") = py::none(), update_text);
}

/// The law, when its parameters are allowed.
template <class L>
L checked(const L& law)
{
  check(law);
  return law;
}
} // namespace mpm::python
