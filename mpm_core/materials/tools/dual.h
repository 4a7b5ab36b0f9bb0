#pragma once
/// @file
/// Numbers with their derivatives by a few variables, for the Jacobians of small systems of equations: an equation that
/// is a template of its numbers is written once, for its value and for its derivatives.

#include <array>
#include <cmath>

namespace mpm::materials
{
template <std::size_t N>
struct Dual
{
  double value = 0;
  std::array<double, N> slopes{};

  constexpr Dual() = default;
  constexpr Dual(double number) : value(number) {} // NOLINT: a constant is a number whose derivatives are zero
};

/// The variable with this number among those by which is differentiated
template <std::size_t N>
constexpr Dual<N> variable(double value, std::size_t number)
{
  Dual<N> x(value);
  x.slopes[number] = 1;
  return x;
}

/// f(x) by its value and its derivative there
template <std::size_t N>
constexpr Dual<N> chained(const Dual<N>& x, double value, double slope)
{
  Dual<N> y(value);
  for (std::size_t k = 0; k < N; ++k)
    y.slopes[k] = slope * x.slopes[k];
  return y;
}
constexpr double chained(double, double value, double) { return value; }

/// f(x, y) by its value and its derivatives there
template <std::size_t N>
constexpr Dual<N> chained(const Dual<N>& x, const Dual<N>& y, double value, double by_x, double by_y)
{
  Dual<N> z(value);
  for (std::size_t k = 0; k < N; ++k)
    z.slopes[k] = by_x * x.slopes[k] + by_y * y.slopes[k];
  return z;
}

template <std::size_t N>
constexpr Dual<N> operator-(const Dual<N>& x)
{
  return chained(x, -x.value, -1);
}
template <std::size_t N>
constexpr Dual<N> operator+(const Dual<N>& x, const Dual<N>& y)
{
  return chained(x, y, x.value + y.value, 1, 1);
}
template <std::size_t N>
constexpr Dual<N> operator-(const Dual<N>& x, const Dual<N>& y)
{
  return chained(x, y, x.value - y.value, 1, -1);
}
template <std::size_t N>
constexpr Dual<N> operator*(const Dual<N>& x, const Dual<N>& y)
{
  return chained(x, y, x.value * y.value, y.value, x.value);
}
template <std::size_t N>
constexpr Dual<N> operator/(const Dual<N>& x, const Dual<N>& y)
{
  const double quotient = x.value / y.value;
  return chained(x, y, quotient, 1 / y.value, -quotient / y.value);
}
template <std::size_t N>
constexpr Dual<N> operator+(const Dual<N>& x, double y)
{
  return chained(x, x.value + y, 1);
}
template <std::size_t N>
constexpr Dual<N> operator+(double x, const Dual<N>& y)
{
  return y + x;
}
template <std::size_t N>
constexpr Dual<N> operator-(const Dual<N>& x, double y)
{
  return x + -y;
}
template <std::size_t N>
constexpr Dual<N> operator-(double x, const Dual<N>& y)
{
  return chained(y, x - y.value, -1);
}
template <std::size_t N>
constexpr Dual<N> operator*(double x, const Dual<N>& y)
{
  return chained(y, x * y.value, x);
}
template <std::size_t N>
constexpr Dual<N> operator*(const Dual<N>& x, double y)
{
  return y * x;
}
template <std::size_t N>
constexpr Dual<N> operator/(const Dual<N>& x, double y)
{
  return chained(x, x.value / y, 1 / y);
}

constexpr double value_of(double x) { return x; }
template <std::size_t N>
constexpr double value_of(const Dual<N>& x)
{
  return x.value;
}

/// The number, or zero where it is negative
template <class T>
constexpr T positive_part(const T& x)
{
  return value_of(x) > 0 ? x : T{};
}

/// Elementary functions of a number, or of one with derivatives
template <class T>
T logarithm(const T& x)
{
  return chained(x, std::log(value_of(x)), 1 / value_of(x));
}
/// Without derivative at zero
template <class T>
T square_root(const T& x)
{
  const double value = std::sqrt(value_of(x));
  return chained(x, value, value > 0 ? 0.5 / value : 0.0);
}
} // namespace mpm::materials
