#pragma once
/// @file
/// The Lode angle of a deviator, by the cosine of its threefold.

#include "base/lanes.h"
#include "materials/tools/branch_free.h"
#include "materials/tools/deviator.h"

#include <numbers>

namespace mpm::materials
{
/// Value of a polynomial with these coefficients, that of 1 first
template <class T, std::size_t N>
T polynomial(const std::array<T, N>& coefficients, const T& x)
{
  T value = coefficients[N - 1];
  for (std::size_t k = N - 1; k-- > 0;)
    value = value * x + coefficients[k];
  return value;
}

/// Its derivative
template <class T, std::size_t N>
T polynomial_slope(const std::array<T, N>& coefficients, const T& x)
{
  T value = static_cast<double>(N - 1) * coefficients[N - 1];
  for (std::size_t k = N - 1; k-- > 1;)
    value = value * x + static_cast<double>(k) * coefficients[k];
  return value;
}

template <int D, class T = double>
T determinant(const std::array<T, n_stress<D>>& s)
{
  const T in_plane = s[0] * s[1] - s[3] * s[3];
  if constexpr (D == 2)
    return in_plane * s[2];
  else
    return in_plane * s[2] + 2 * s[3] * s[4] * s[5] - s[0] * s[4] * s[4] - s[1] * s[5] * s[5];
}

/// The square s s of a tensor
template <int D, class T = double>
std::array<T, n_stress<D>> square(const std::array<T, n_stress<D>>& s)
{
  const T xy = s[3] * s[3];
  if constexpr (D == 2)
    return {s[0] * s[0] + xy, s[1] * s[1] + xy, s[2] * s[2], (s[0] + s[1]) * s[3]};
  else
  {
    const T yz = s[4] * s[4], xz = s[5] * s[5];
    return {s[0] * s[0] + xy + xz,
            s[1] * s[1] + xy + yz,
            s[2] * s[2] + yz + xz,
            (s[0] + s[1]) * s[3] + s[4] * s[5],
            (s[1] + s[2]) * s[4] + s[3] * s[5],
            (s[0] + s[2]) * s[5] + s[3] * s[4]};
  }
}

/// q^2 = 3 J2 of a deviator s + x t, as a polynomial in x, the coefficient of 1 first
template <int D, class T = double>
std::array<T, 3> square_along(const std::array<T, n_stress<D>>& s, const std::array<T, n_stress<D>>& t)
{
  return {1.5 * product<D>(s, s), 3 * product<D>(s, t), 1.5 * product<D>(t, t)};
}

/// q^3 cos(3 theta) = -13.5 det of a deviator s + x t, as a polynomial in x
template <int D, class T = double>
std::array<T, 4> cube_along(const std::array<T, n_stress<D>>& s, const std::array<T, n_stress<D>>& t)
{
  return {-13.5 * determinant<D>(s), -13.5 * product<D>(square<D>(s), t), -13.5 * product<D>(square<D>(t), s),
          -13.5 * determinant<D>(t)};
}

/// cos(3 theta) of a deviator with q = sqrt(3 J2) and cube = -13.5 det: 1 in triaxial compression, -1 in triaxial
/// extension, 0 where one of the principal stresses is their mean. Where there is no direction, q^3 = 0, it is 1.
template <class T>
T lode_cosine(const T& cube, const T& q)
{
  const T largest = q * q * q, one = T{} + 1;
  return largest > 0 ? larger(smaller(cube / largest, one), -one) : one;
}

/// The series of cos(2/3 arccos(x)) about x = 1/2, by the differential equation that it satisfies as Chebyshev
/// polynomials do; for 0 <= x <= 1 each term is a third of the one before at most.
inline constexpr auto cosine_of_two_thirds = []
{
  constexpr double cosine_40 = 0.766044443118978, sine_40 = 0.6427876096865393; // of 2/3 of arccos(1/2) = 60 degrees
  std::array<double, 32> c{cosine_40, 4 * sine_40 * std::numbers::inv_sqrt3 / 3};
  for (std::size_t k = 0; k + 2 < c.size(); ++k)
  {
    const double n = static_cast<double>(k);
    c[k + 2] = (0.5 * (n + 1) * (2 * n + 1) * c[k + 1] + (n * n - 4.0 / 9) * c[k]) / (0.75 * (n + 1) * (n + 2));
  }
  return c;
}();

/// cos(theta) of an angle from 0 to 60 degrees by cos(3 theta)
template <class T>
T third_cosine(const T& threefold)
{
  const T half = root<T>((1 + threefold) / 2); // cos(3 theta / 2)
  return power_series<cosine_of_two_thirds, 0, 1, cosine_of_two_thirds.size(), T>(half - 0.5);
}

/// Derivative of cos(3 theta) by the deviator, itself a deviator; zero where there is no direction
template <int D>
SymTensor<D> lode_cosine_slope(const SymTensor<D>& deviator, double q, double cosine)
{
  if (!(q * q * q > 0))
    return {};
  const double scale = 1 / q;
  SymTensor<D> slope = square<D>(deviator);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    slope[k] = -(13.5 * (slope[k] * scale - (k < 3 ? 2 * q / 9 : 0.0)) + 4.5 * cosine * deviator[k]) * scale * scale;
  return slope;
}
} // namespace mpm::materials
