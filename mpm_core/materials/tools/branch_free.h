#pragma once
/// @file
/// Elementary functions without branches and calls: loops over points that use them vectorise, which those of the
/// standard library prevent.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <numbers>

namespace mpm::materials
{
/// 1 / n! for n from 0 on, the coefficients of the series below
inline constexpr auto per_factorial = []
{
  std::array<double, 24> values{1.0};
  double factorial = 1;
  for (std::size_t n = 1; n < values.size(); ++n)
    values[n] = 1 / (factorial *= static_cast<double>(n));
  return values;
}();

/// The sum of coefficients[first + k stride] x^k for k < count, of a number or of several side by side. Even and odd
/// powers are summed side by side, again and again: a processor waits for a chain of sums, not for their number.
/// Source: Estrin (1960), Proc. Western Joint Computer Conference, 33-40.
template <const auto& coefficients, std::size_t first, std::size_t stride, std::size_t count, class T>
[[gnu::always_inline]] inline T power_series(const T& x)
{
  if constexpr (count == 1)
    return T{} + coefficients[first];
  else
    return power_series<coefficients, first, 2 * stride, (count + 1) / 2, T>(x * x) +
           x * power_series<coefficients, first + stride, 2 * stride, count / 2, T>(x * x);
}

/// The sum of x^k / (first + k stride)! for k < count
template <std::size_t first, std::size_t stride, std::size_t count>
[[gnu::always_inline]] inline double series(double x)
{
  return power_series<per_factorial, first, stride, count>(x);
}

/// ln 2 in two parts; an integer of up to 11 bits times the first one is exact.
inline constexpr double ln2_high = 0x1.62e42fefap-1, ln2_low = 0x1.cf79abc9e3b398p-40;
/// Added to a number it rounds that to an integer, held by the last bits.
inline constexpr double integer_shift = 0x1.8p52;

/// exp(-x) for x >= -700, to round-off: with x = n ln 2 - r it is exp(r) / 2^n, where |r| <= ln 2 / 2.
/// From x = 700 on it stays what it is there, 1e-304.
[[gnu::always_inline]] inline double falling_exponential(double x)
{
  constexpr double shift = integer_shift;
  const double bounded = x > 700 ? 700.0 : x;
  const double shifted = bounded * std::numbers::log2e + shift;
  const double n = shifted - shift;
  const double r = (n * ln2_high - bounded) + n * ln2_low;
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(shifted);
  return (1 + r * series<1, 1, 13>(r)) * std::bit_cast<double>((std::uint64_t{1023} << 52) - (bits << 52));
}

/// 1 / (2 n + 1)
inline constexpr auto per_odd = []
{
  std::array<double, 12> values{};
  for (std::size_t n = 0; n < values.size(); ++n)
    values[n] = 1 / (2 * static_cast<double>(n) + 1);
  return values;
}();

/// ln(x) of a positive normal number, to round-off: with x = 2^n m, where sqrt(1/2) <= m < sqrt(2), it is
/// n ln 2 + 2 artanh(z), where z = (m - 1) / (m + 1)
[[gnu::always_inline]] inline double natural_logarithm(double x)
{
  constexpr std::uint64_t lowest = std::bit_cast<std::uint64_t>(std::numbers::sqrt2 / 2), bias = 1024;
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(x);
  const std::uint64_t biased = (bits - lowest + (bias << 52)) >> 52; // n, made positive
  const double m = std::bit_cast<double>(bits - ((biased - bias) << 52));
  const double n = std::bit_cast<double>(std::bit_cast<std::uint64_t>(integer_shift) + biased) -
                   (integer_shift + static_cast<double>(bias));
  const double z = (m - 1) / (m + 1), square = z * z;
  return n * ln2_high + (2 * z * power_series<per_odd, 0, 1, per_odd.size()>(square) + n * ln2_low) +
         (x - x); // NaN and infinity give NaN
}

/// sin(x) for |x| <= pi / 2, by its series
[[gnu::always_inline]] inline double short_sine(double x) { return x - x * (x * x * series<3, 2, 11>(-x * x)); }

/// cos(x) for |x| <= pi / 2, by its series
[[gnu::always_inline]] inline double short_cosine(double x)
{
  return 1 - x * x * (0.5 - x * x * series<4, 2, 10>(-x * x));
}
} // namespace mpm::materials
