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

/// The rows that a law works on
struct Rows
{
  py::array_t<double> strain, stress, state, tangent;
};

template <int D>
Rows loaded(const PointBatch<D>& points, int states)
{
  constexpr int S = n_stress<D>;
  py::array_t<double> tangent({points.tangent ? points.size : 0, S, S});
  std::fill_n(tangent.mutable_data(), tangent.size(), 0.0);
  return {rows_of(points.strain_increment.data(), S, points.size), rows_of(points.stress.data(), S, points.size),
          rows_of(points.state, states, points.size), tangent};
}

/// Time, duration, sizes of cells and deformation gradients, as the attributes of an object
template <int D>
py::object increment_of(const PointBatch<D>& points)
{
  using namespace py::literals;
  py::object sizes = py::none(), deformation = py::none();
  if (points.cell_size)
    sizes = py::array_t<double>(points.size, points.cell_size);
  if (points.deformation.front())
    deformation = rows_of(points.deformation.data(), D * D, points.size).reshape({points.size, D, D});
  return py::module_::import("types").attr("SimpleNamespace")("time"_a = points.time, "dt"_a = points.dt,
                                                              "cell_size"_a = sizes, "deformation"_a = deformation);
}

/// Takes over what a law has written, but in the points whose stress or state is not finite: they have failed.
template <int D>
BatchReport stored(const PointBatch<D>& points, const Rows& rows, int states)
{
  constexpr int S = n_stress<D>;
  const auto finite = [](const double* first, int count)
  { return std::all_of(first, first + count, [](double v) { return std::isfinite(v); }); };
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    const double* const stress = rows.stress.data() + static_cast<std::ptrdiff_t>(i) * S;
    const double* const state = rows.state.data() + static_cast<std::ptrdiff_t>(i) * states;
    if (!finite(stress, S) || !finite(state, states))
    {
      report.failed.push_back(i);
      continue;
    }
    report.plastic += state[0] > points.state[0][i] ? 1 : 0;
    for (std::size_t k = 0; k < S; ++k)
      points.stress[k][i] = stress[k];
    for (int k = 0; k < states; ++k)
      points.state[k][i] = state[k];
  }
  if (points.tangent)
    std::copy_n(rows.tangent.data(), static_cast<std::size_t>(points.size) * S * S, points.tangent);
  return report;
}

/// A Python object that updates points
struct PythonObject
{
  py::object law;
  int states;
  /// Whether its update takes an `increment` beside the rest
  bool takes_increment;
  /// Whether an exception of it has been printed; shared by all copies
  std::shared_ptr<bool> has_warned = std::make_shared<bool>(false);
};

/// The points of a batch one by one, so that an exception is that of a single point
template <int D>
BatchReport called_one_by_one(const PythonObject& object, const PointBatch<D>& points);

/// Calls the update of a Python object on one batch. No caller could take an exception through a parallel run: the
/// first is printed, and the points that raise one count as failed.
template <int D>
BatchReport called(const PythonObject& object, const PointBatch<D>& points)
{
  py::gil_scoped_acquire acquire;
  try
  {
    const Rows rows = loaded(points, object.states);
    const py::object tangent = points.tangent ? py::object(rows.tangent) : py::none();
    if (object.takes_increment)
      object.law.attr("update")(rows.strain, rows.stress, rows.state, tangent,
                                py::arg("increment") = increment_of(points));
    else
      object.law.attr("update")(rows.strain, rows.stress, rows.state, tangent);
    return stored(points, rows, object.states);
  }
  catch (py::error_already_set& error)
  {
    if (!*object.has_warned)
      error.discard_as_unraisable("the update of a law");
    *object.has_warned = true;
  }
  if (points.size == 1)
    return {0, {0}};
  return called_one_by_one(object, points);
}

template <int D>
BatchReport called_one_by_one(const PythonObject& object, const PointBatch<D>& points)
{
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    const BatchSlice<D> point(points, i, 1, object.states);
    const BatchReport one = called(object, point.batch);
    report.plastic += one.plastic;
    if (!one.failed.empty())
      report.failed.push_back(i);
  }
  return report;
}

ExternalLaw python_law(const py::object& law);

/// A copy of a Python object with some other attributes; of a dataclass one that is constructed anew
py::object with_attributes(const py::object& law, const py::dict& changed)
{
  if (py::module_::import("dataclasses").attr("is_dataclass")(law).cast<bool>())
    return py::module_::import("dataclasses").attr("replace")(law, **changed);
  py::object copy = py::module_::import("copy").attr("copy")(law);
  for (const auto& [name, value] : changed)
    py::setattr(copy, name, value);
  return copy;
}

/// A member of a Python object
/// @throws InputError it is of another type
template <class T>
T member(const py::object& law, const std::string& name, const char* expected)
{
  const py::object value = law.attr(name.c_str());
  try
  {
    return value.cast<T>();
  }
  catch (const py::cast_error&)
  {
    throw InputError("law has the " + name + " " + py::repr(value).cast<std::string>() + ", expected " + expected);
  }
}

/// What a Python object says of its strength, if it names it, in the law that is made of it
void add_strength(const py::object& law, ExternalLaw& made)
{
  if (!py::hasattr(law, "strength_parameters"))
    return;
  std::vector<std::string> names;
  std::vector<StrengthKind> kinds;
  if (!py::isinstance<py::dict>(law.attr("strength_parameters")))
    throw InputError("law has the strength_parameters " +
                     py::repr(law.attr("strength_parameters")).cast<std::string>() + ", expected a dictionary");
  for (const auto& [name, kind] : law.attr("strength_parameters").cast<py::dict>())
  {
    names.push_back(py::str(name));
    kinds.push_back(strength_kind(std::string(py::str(kind))));
    if (!py::hasattr(law, names.back().c_str()))
      throw InputError("law names " + names.back() + " in strength_parameters, but has no such attribute");
  }
  check(kinds);
  if (names.empty())
    return;
  const auto values_now = [law, names]
  {
    std::vector<double> values;
    for (const std::string& name : names)
      values.push_back(member<double>(law, name, "a number"));
    return values;
  };
  made.association = associated_fraction(kinds, values_now());
  made.weaker = [law, names, kinds, values_now](double factor)
  {
    const std::vector<double> values = reduced_values(kinds, values_now(), factor);
    py::dict changed;
    for (std::size_t k = 0; k < names.size(); ++k)
      changed[names[k].c_str()] = values[k];
    return python_law(with_attributes(law, changed));
  };
}

ExternalLaw python_law(const py::object& law)
{
  for (const char* member : {"n_state", "p_wave_modulus", "update"})
    if (!py::hasattr(law, member))
      throw InputError("law is " + py::repr(law).cast<std::string>() + ", which has no " + member);
  if (py::isinstance<py::type>(law))
    throw InputError("law is the class " + law.attr("__name__").cast<std::string>() + ", expected an object of it");
  const int states = member<int>(law, "n_state", "a whole number");
  if (states < 1)
    throw InputError("law has n_state " + std::to_string(states) +
                     ", expected at least 1: the first is the accumulated plastic deviatoric strain");
  std::vector<std::string> names{"plastic_strain"};
  for (int k = 1; k < states; ++k)
    names.push_back("state_" + std::to_string(k));
  if (py::hasattr(law, "state_names"))
    names = member<std::vector<std::string>>(law, "state_names", "a list of names");
  if (static_cast<int>(names.size()) != states || names.front() != "plastic_strain")
    throw InputError("law has state_names of another number than n_state, or not plastic_strain as the first");
  const bool takes_increment =
      py::module_::import("inspect").attr("signature")(law.attr("update")).attr("parameters").contains("increment");
  const PythonObject object{law, states, takes_increment};
  ExternalLaw made{"PythonLaw of " + py::type::of(law).attr("__name__").cast<std::string>(),
                   std::move(names),
                   member<double>(law, "p_wave_modulus", "a number [Pa]"),
                   [object](const PointBatch<2>& points) { return called(object, points); },
                   [object](const PointBatch<3>& points) { return called(object, points); },
                   law.ptr(),
                   {takes_increment, takes_increment}};
  add_strength(law, made);
  return made;
}
} // namespace

void bind_python_law(py::module_& m)
{
  bind_law<ExternalLaw>(m, "PythonLaw", "A law written in Python on NumPy arrays, for trying ideas.",
                        R"(The object has these members.

- n_state: number of state variables, at least 1; the first is the accumulated plastic deviatoric strain.
- p_wave_modulus: modulus of the compression wave [Pa], for the critical time step.
- update(strain_increment, stress, state, tangent): updates in place, as the method `update` of any law;
  tangent is None in the explicit scheme.
- state_names: names of the state variables, optional.
- strength_parameters: what those attributes are that a factor of safety divides, by their names, optional: a dictionary
  such as {"c": "strength", "phi": "friction angle", "psi": "dilation angle"}, angles in degrees. A strength is divided,
  and so is the tangent of a friction angle; a dilation angle is at most the friction angle that is named before it. The
  weaker law is a copy of the object with other attributes, or a dataclass constructed anew.

If update has a further parameter `increment`, it receives an object with the attributes time [s], dt [s], cell_size [m],
shape (n,) or None, and deformation, shape (n, D, D) or None: the time at the start, the duration (infinite where loading is
infinitely slow), the sizes of the points' cells, and the increment of the deformation gradient, where None stands for
1 + strain increment.

A law that has no solution at a point sets its stress or a state variable to NaN; the point then fails. An exception in
update is a failure of all its points; they are then tried one by one, and the first exception of a law is printed.)",
                        [](const Parts& parts) { return python_law(parts.get<py::object>("law", "an object")); })
      .def_property_readonly(
          "law",
          [](const ExternalLaw& law)
          {
            auto* const object = static_cast<PyObject*>(const_cast<void*>(law.identity));
            return py::reinterpret_borrow<py::object>(object);
          },
          "The object that was given");
}
} // namespace mpm::python
