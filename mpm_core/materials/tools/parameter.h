#pragma once
/// @file
/// How a law declares its parameters: once, in its struct. Checks, the Python class, its help and the documentation
/// follow from the declaration.

#include "base/number_text.h"
#include "base/types.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

namespace mpm::materials
{
/// A number in a law, or in a law within it: `entry<&MohrCoulomb::young>`
template <auto... members>
struct Entry
{
};
template <auto... members>
inline constexpr Entry<members...> entry{};

/// A bound of a parameter: a number, or another parameter of the same law.
template <class L>
struct Bound
{
  double number;
  bool included;
  double (*other)(const L&) = nullptr; ///< the other parameter, where it is one
  std::string_view name = {};          ///< its name

  double of(const L& law) const { return other ? other(law) : number; }
};

/// One parameter of a law, a real number.
template <class L>
struct Parameter
{
  std::string_view name;
  std::string_view unit; ///< "-" for a number without unit
  Bound<L> lower, upper;
  std::string_view meaning;
  double (*value)(const L&);
  void (*set)(L&, double);
  std::optional<double> standard; ///< what it is unless given; infinite for "without limit"
};

/// A part of a law that is not a real number, such as another law; Python's class says how it is read.
struct Part
{
  std::string_view name, meaning;
  bool needed = true;
};

namespace detail
{
template <class L, auto... members>
double value(const L& law)
{
  return (law.*....*members);
}

template <class L, auto... members>
void set(L& law, double number)
{
  (law.*....*members) = number;
}
} // namespace detail

inline constexpr double unlimited = std::numeric_limits<double>::infinity();

template <class L>
struct Range
{
  Bound<L> lower, upper;
};

/// Greater than a number, at least a number, between two
template <class L>
constexpr Range<L> above(double number)
{
  return {{number, false}, {unlimited, false}};
}
template <class L>
constexpr Range<L> at_least(double number)
{
  return {{number, true}, {unlimited, false}};
}
template <class L>
constexpr Range<L> between(double lower, double upper)
{
  return {{lower, false}, {upper, false}};
}

/// Greater than another parameter
template <class L, auto... members>
constexpr Range<L> above(std::string_view name, Entry<members...>)
{
  return {{0, false, &detail::value<L, members...>, name}, {unlimited, false}};
}

/// From zero to another parameter
template <class L, auto... members>
constexpr Range<L> up_to(std::string_view name, Entry<members...>)
{
  return {{0, true}, {0, true, &detail::value<L, members...>, name}};
}

/// The range with infinity in it
template <class L>
constexpr Range<L> or_infinite(Range<L> range)
{
  range.upper.included = true;
  return range;
}

/// The declaration of a parameter of the law L.
template <class L, auto... members>
constexpr Parameter<L> parameter(std::string_view name, Entry<members...>, std::string_view unit, Range<L> range,
                                 std::string_view meaning, std::optional<double> standard = {})
{
  return {name,    unit, range.lower, range.upper, meaning, &detail::value<L, members...>, &detail::set<L, members...>,
          standard};
}

/// Declarations of the elasticity that most laws share
template <class L, auto... members>
constexpr Parameter<L> young_parameter(Entry<members...> young)
{
  return parameter<L>("young", young, "Pa", above<L>(0), "Young's modulus");
}
template <class L, auto... members>
constexpr Parameter<L> poisson_parameter(Entry<members...> poisson)
{
  return parameter<L>("poisson", poisson, "-", between<L>(-1, 0.5), "Poisson's ratio");
}

/// The range of a parameter in words: "positive", "in [0, 90)", "in [0, friction_angle]"
template <class L>
std::string range_text(const Parameter<L>& parameter);

/// Throws InputError, with name, value and range, for the first parameter that is out of its range.
template <class L>
void check_parameters(const L& law);

/// Throws InputError with a parameter's name, its value and what it must be.
[[noreturn]] void refuse(std::string_view name, double value, std::string_view range);

template <class L>
std::string range_text(const Parameter<L>& parameter)
{
  const auto text = [](const Bound<L>& bound)
  { return bound.other ? std::string(bound.name) : number_text(bound.number); };
  const Bound<L>&lower = parameter.lower, &upper = parameter.upper;
  if (upper.other || upper.number < unlimited)
    return (lower.included ? "in [" : "in (") + text(lower) + ", " + text(upper) + (upper.included ? "]" : ")");
  if (!lower.other && lower.number == 0)
    return lower.included ? "at least 0" : "positive";
  return (lower.included ? "at least " : "above ") + text(lower);
}

template <class L>
void check_parameters(const L& law)
{
  const auto is_within = [](double value, const Bound<L>& lower, const Bound<L>& upper, double low, double high)
  { return (lower.included ? value >= low : value > low) && (upper.included ? value <= high : value < high); };
  // Bounds that are numbers first, since those that are other parameters mean nothing where these are out of range
  for (const bool by_others : {false, true})
    for (const Parameter<L>& parameter : L::parameters())
    {
      const Bound<L>&lower = parameter.lower, &upper = parameter.upper;
      const bool has_other = lower.other || upper.other;
      if (has_other != by_others)
        continue;
      const double value = parameter.value(law);
      if (is_within(value, lower, upper, lower.of(law), upper.of(law)))
        continue;
      const bool has_limit = parameter.upper.other || parameter.upper.number < unlimited;
      std::string range = range_text(parameter);
      if (parameter.unit != "-" && has_limit)
        range += " [" + std::string(parameter.unit) + "]";
      else if (parameter.unit != "-")
        range += (parameter.upper.included ? " [" : " and finite [") + std::string(parameter.unit) + "]" +
                 (parameter.upper.included ? " (or infinite)" : "");
      else if (!has_limit)
        range += " and finite";
      for (const Bound<L>* bound : {&lower, &upper})
        if (bound->other)
          range += "; " + std::string(bound->name) + " is " + number_text(bound->of(law));
      refuse(parameter.name, value, range);
    }
}
} // namespace mpm::materials
