#include "python/bindings.h"
#include "python/law_binding.h"

namespace mpm::python
{
namespace
{
/// Copies columns to the rows of a new array.
py::array_t<double> rows_of(const double* const* columns, int width, Index size)
{
  py::array_t<double> array({static_cast<py::ssize_t>(size), static_cast<py::ssize_t>(width)});
  double* const out = array.mutable_data();
  for (int k = 0; k < width; ++k)
    for (Index i = 0; i < size; ++i)
      out[static_cast<std::ptrdiff_t>(i) * width + k] = columns[k][i];
  return array;
}

void copy_back(const py::array_t<double>& array, double* const* columns, int width, Index size)
{
  const double* const in = array.data();
  for (int k = 0; k < width; ++k)
    for (Index i = 0; i < size; ++i)
      columns[k][i] = in[static_cast<std::ptrdiff_t>(i) * width + k];
}

/// Takes over what a law has written. Points whose stress or state is not finite have failed; then all is left as it
/// was.
template <int D>
BatchReport stored(const PointBatch<D>& points, const py::array_t<double>& stress, const py::array_t<double>& state,
                   const py::array_t<double>& tangent, int states)
{
  constexpr int S = n_stress<D>;
  const auto finite = [](const double* first, int count)
  { return std::all_of(first, first + count, [](double v) { return std::isfinite(v); }); };
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
    if (!finite(stress.data() + i * S, S) || !finite(state.data() + i * states, states))
      report.first_failed = report.failed++ == 0 ? i : report.first_failed;
  if (report.failed > 0)
    return report;
  const Column before(points.state[0], points.state[0] + points.size);
  copy_back(stress, points.stress.data(), S, points.size);
  copy_back(state, points.state, states, points.size);
  for (Index i = 0; i < points.size; ++i)
    report.plastic += points.state[0][i] > before[static_cast<std::size_t>(i)] ? 1 : 0;
  if (points.tangent)
    std::copy_n(tangent.data(), static_cast<std::size_t>(points.size) * S * S, points.tangent);
  return report;
}

/// Calls the update of a Python object on one batch. An exception is printed, as no caller could take it through a
/// parallel run, and all points count as failed.
template <int D>
BatchReport call(const py::object& law, int states, const PointBatch<D>& points)
{
  constexpr int S = n_stress<D>;
  py::gil_scoped_acquire acquire;
  try
  {
    const auto strain = rows_of(points.strain_increment.data(), S, points.size);
    const auto stress = rows_of(points.stress.data(), S, points.size);
    const auto state = rows_of(points.state, states, points.size);
    py::array_t<double> tangent({points.tangent ? points.size : 0, S, S});
    std::fill_n(tangent.mutable_data(), tangent.size(), 0.0);
    law.attr("update")(strain, stress, state, points.tangent ? py::object(tangent) : py::none());
    return stored<D>(points, stress, state, tangent, states);
  }
  catch (py::error_already_set& error)
  {
    error.discard_as_unraisable("the update of a law");
    return {0, points.size, 0};
  }
}

ExternalLaw python_law(const py::object& law)
{
  const int states = law.attr("n_state").cast<int>();
  if (states < 1)
    throw InputError("law has n_state " + std::to_string(states) +
                     ", expected at least 1: the first is the accumulated plastic deviatoric strain");
  std::vector<std::string> names{"plastic_strain"};
  for (int k = 1; k < states; ++k)
    names.push_back("state_" + std::to_string(k));
  if (py::hasattr(law, "state_names"))
    names = law.attr("state_names").cast<std::vector<std::string>>();
  if (static_cast<int>(names.size()) != states || names.front() != "plastic_strain")
    throw InputError("law has state_names of another number than n_state, or not plastic_strain as the first");
  return checked(ExternalLaw{std::move(names), law.attr("p_wave_modulus").cast<double>(),
                             [law, states](const PointBatch<2>& points) { return call<2>(law, states, points); },
                             [law, states](const PointBatch<3>& points) { return call<3>(law, states, points); },
                             law.ptr()});
}
} // namespace

void bind_python_law(py::module_& m)
{
  bind_law<ExternalLaw>(m, "PythonLaw", R"(A law written in Python on NumPy arrays, for trying ideas.

Args:
    law: an object with these members.

        - n_state: number of state variables, at least 1; the first is the accumulated plastic deviatoric strain.
        - p_wave_modulus: modulus of the compression wave [Pa], for the critical time step.
        - update(strain_increment, stress, state, tangent): updates in place, as the method `update` of any law;
          tangent is None in the explicit scheme.
        - state_names: names of the state variables, optional.

An exception in update is printed, and counts as a failure of its points; so does a value that is not finite.)")
      .def(py::init(&python_law), py::arg("law"));
}
} // namespace mpm::python
