#pragma once
/// @file
/// Numbers with their derivatives by a few variables, for the Jacobians of small systems of equations: an equation that
/// is a template of its numbers is written once, for its value and for its derivatives.

#include "base/lanes.h"
#include "materials/tools/branch_free.h"

#include <array>

namespace mpm::materials
{
/// A number of type T, that of one point or `Lanes`, with its derivatives by N variables
template <std::size_t N, class T = double>
struct Dual
{
  T value{};
  std::array<T, N> slopes{};

  constexpr Dual() = default;
  constexpr Dual(const T& number) : value(number) {} // NOLINT: a constant is a number whose derivatives are zero
};

/// The variable with this number among those by which is differentiated
template <std::size_t N, class T>
constexpr Dual<N, T> variable(const T& value, std::size_t number)
{
  Dual<N, T> x(value);
  x.slopes[number] = T{} + 1;
  return x;
}

constexpr double value_of(double x) { return x; }
constexpr Lanes value_of(const Lanes& x) { return x; }
template <std::size_t N, class T>
constexpr T value_of(const Dual<N, T>& x)
{
  return x.value;
}

/// The type of the numbers of a T
template <class T>
using Number = decltype(value_of(T{}));

/// f(x) by its value and its derivative there
template <std::size_t N, class T, class Slope>
constexpr Dual<N, T> chained(const Dual<N, T>& x, const T& value, const Slope& slope)
{
  Dual<N, T> y(value);
  for (std::size_t k = 0; k < N; ++k)
    y.slopes[k] = slope * x.slopes[k];
  return y;
}
template <class T, class Slope>
constexpr T chained(const T&, const T& value, const Slope&)
{
  return value;
}

/// f(x, y) by its value and its derivatives there
template <std::size_t N, class T, class Slope>
constexpr Dual<N, T> chained(const Dual<N, T>& x, const Dual<N, T>& y, const T& value, const Slope& by_x,
                             const Slope& by_y)
{
  Dual<N, T> z(value);
  for (std::size_t k = 0; k < N; ++k)
    z.slopes[k] = by_x * x.slopes[k] + by_y * y.slopes[k];
  return z;
}

template <std::size_t N, class T>
constexpr Dual<N, T> operator-(const Dual<N, T>& x)
{
  return chained(x, T(-x.value), -1);
}
template <std::size_t N, class T>
constexpr Dual<N, T> operator+(const Dual<N, T>& x, const Dual<N, T>& y)
{
  return chained(x, y, T(x.value + y.value), 1, 1);
}
template <std::size_t N, class T>
constexpr Dual<N, T> operator-(const Dual<N, T>& x, const Dual<N, T>& y)
{
  return chained(x, y, T(x.value - y.value), 1, -1);
}
template <std::size_t N, class T>
constexpr Dual<N, T> operator*(const Dual<N, T>& x, const Dual<N, T>& y)
{
  return chained(x, y, T(x.value * y.value), y.value, x.value);
}
template <std::size_t N, class T>
constexpr Dual<N, T> operator/(const Dual<N, T>& x, const Dual<N, T>& y)
{
  const T quotient = x.value / y.value;
  return chained(x, y, quotient, T(1 / y.value), T(-quotient / y.value));
}

// With a constant: a number of the same type, or of one point
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator+(const Dual<N, T>& x, const Constant& y)
{
  return chained(x, T(x.value + y), 1);
}
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator+(const Constant& x, const Dual<N, T>& y)
{
  return y + x;
}
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator-(const Dual<N, T>& x, const Constant& y)
{
  return x + -y;
}
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator-(const Constant& x, const Dual<N, T>& y)
{
  return chained(y, T(x - y.value), -1);
}
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator*(const Constant& x, const Dual<N, T>& y)
{
  return chained(y, T(x * y.value), x);
}
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator*(const Dual<N, T>& x, const Constant& y)
{
  return y * x;
}
template <std::size_t N, class T, class Constant>
constexpr Dual<N, T> operator/(const Dual<N, T>& x, const Constant& y)
{
  return chained(x, T(x.value / y), T(1 / (T{} + y)));
}

/// Either of two numbers, for each point by itself
template <class T>
constexpr T chosen(const Mask<Number<T>>& first, const T& x, const T& y)
{
  if constexpr (std::is_same_v<Number<T>, double> || std::is_same_v<T, Lanes>)
    return first ? x : y;
  else
  {
    T z(first ? x.value : y.value);
    for (std::size_t k = 0; k < z.slopes.size(); ++k)
      z.slopes[k] = first ? x.slopes[k] : y.slopes[k];
    return z;
  }
}

/// The number, or zero where it is negative
template <class T>
constexpr T positive_part(const T& x)
{
  return chosen(value_of(x) > 0, x, T{});
}

/// Elementary functions of a positive number, or of one with derivatives
template <class T>
T logarithm(const T& x)
{
  return chained(x, each(value_of(x), natural_logarithm), Number<T>(1 / value_of(x)));
}
/// Without derivative at zero
template <class T>
T square_root(const T& x)
{
  const Number<T> value = root(value_of(x));
  return chained(x, value, chosen(value > 0, Number<T>(0.5 / value), Number<T>{}));
}
} // namespace mpm::materials
