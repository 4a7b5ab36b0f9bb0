#pragma once
/// @file
/// The arguments of a law's constructor in Python, by what the law declares.

#include "materials/tools/parameter.h"

#include <pybind11/pybind11.h>

#include <optional>
#include <vector>

namespace mpm::python
{
namespace py = pybind11;

/// What a law declares of a parameter, or of a part, as Python sees it.
struct Declaration
{
  std::string name;
  std::optional<std::string> unit; ///< none: a part, which is no real number
  std::string meaning;
  std::string range;                   ///< in words; empty for a part
  bool needed;                         ///< whether it must be given
  std::optional<double> standard;      ///< what it is unless given; none: it must be given, or there is no limit
  std::optional<double> lower, upper;  ///< bounds; none where there are none, or where they are other parameters
  bool lower_included, upper_included; ///< whether the parameter may be equal to the bound
};

template <class L>
Declaration declaration(const Parameter<L>& p)
{
  const auto number = [](const Bound<L>& bound) -> std::optional<double>
  {
    if (bound.other || std::isinf(bound.number))
      return {};
    return bound.number;
  };
  const auto standard = p.standard && std::isfinite(*p.standard) ? p.standard : std::nullopt;
  return {std::string(p.name), std::string(p.unit),     std::string(p.meaning),
          range_text(p),       !p.standard.has_value(), standard,
          number(p.lower),     number(p.upper),         p.lower.included,
          p.upper.included};
}

/// All that a law declares: parts first, which may be given without a name, then its parameters.
template <class L>
std::vector<Declaration> declarations()
{
  std::vector<Declaration> all;
  if constexpr (requires { L::parts; })
    for (const Part& part : L::parts)
      all.push_back({std::string(part.name), {}, std::string(part.meaning), "", part.needed, {}, {}, {}, false, false});
  for (const auto& parameter : L::parameters())
    all.push_back(declaration(parameter));
  return all;
}

/// The text of a class: what it is, its parameters as declared, and further remarks.
std::string class_text(const std::vector<Declaration>& declared, const std::string& summary,
                       const std::string& remarks);

/// The arguments by name.
/// @throws InputError one that is unknown, missing, or without a name where it needs one
py::dict named_arguments(const std::string& law, const std::vector<Declaration>& declared, const py::args& args,
                         const py::kwargs& given);

/// Throws InputError saying what was expected of an argument.
[[noreturn]] void refuse_argument(const std::string& law, const std::string& name, const py::handle& value,
                                  const std::string& expected);

/// An argument that is a real number
double number(const std::string& law, const std::string& name, const py::handle& value);

/// Arguments of a law that are parts
struct Parts
{
  const std::string& law;
  const py::dict& values;

  /// @param expected  in words, for the message where it is of another type
  template <class T>
  T get(const char* name, const char* expected) const
  {
    const py::object value = values[name];
    try
    {
      return value.cast<T>();
    }
    catch (const py::cast_error&)
    {
      refuse_argument(law, name, value, expected);
    }
  }

  template <class T>
  T get(const char* name, const char* expected, const T& standard) const
  {
    return values.contains(name) ? get<T>(name, expected) : standard;
  }
};

/// The law that arguments describe.
/// @param with_parts  function of Parts that returns the law with its parts, and any numbers
/// @throws InputError as `named_arguments`, or a parameter that is no number or out of its range
template <class L, class F>
L constructed(const std::string& name, F&& with_parts, const py::args& args, const py::kwargs& given)
{
  const py::dict values = named_arguments(name, declarations<L>(), args, given);
  L law = with_parts(Parts{name, values});
  for (const Parameter<L>& parameter : L::parameters())
  {
    const std::string key(parameter.name);
    const bool is_given = values.contains(key) && !(values[key.c_str()].is_none() && parameter.standard);
    parameter.set(law, is_given ? number(name, key, values[key.c_str()]) : *parameter.standard);
  }
  check(law);
  return law;
}

/// The law with its declared values in Python's notation, with units.
template <class L>
std::string representation(const std::string& name, const py::object& law)
{
  std::string text = name + "(";
  for (const Declaration& d : declarations<L>())
  {
    const py::object value = law.attr(d.name.c_str());
    text += text.back() == '(' ? "" : ", ";
    text += d.name + "=" + (d.unit ? number_text(value.cast<double>()) : py::repr(value).cast<std::string>());
    text += d.unit && *d.unit != "-" ? " " + *d.unit : "";
  }
  return text + ")";
}
} // namespace mpm::python
