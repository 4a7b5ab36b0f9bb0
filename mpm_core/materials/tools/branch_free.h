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

/// The sum of x^k / (first + k stride)! for k < count. Even and odd powers are summed side by side, again and again: a
/// processor waits for a chain of sums, not for their number. Source: Estrin (1960), Proc. Western Joint Computer
/// Conference, 33-40.
template <std::size_t first, std::size_t stride, std::size_t count>
[[gnu::always_inline]] inline double series(double x)
{
  if constexpr (count == 1)
    return per_factorial[first];
  else
    return series<first, 2 * stride, (count + 1) / 2>(x * x) + x * series<first + stride, 2 * stride, count / 2>(x * x);
}

/// exp(-x) for x >= 0, to round-off: with x = n ln 2 - r it is exp(r) / 2^n, where |r| <= ln 2 / 2.
/// From x = 700 on it stays what it is there, 1e-304.
[[gnu::always_inline]] inline double falling_exponential(double x)
{
  constexpr double ln2_high = 0x1.62e42fefap-1, ln2_low = 0x1.cf79abc9e3b398p-40; // n times the first one is exact
  constexpr double shift = 0x1.8p52; // added to a number it rounds that to an integer, held by the last bits
  const double bounded = x > 700 ? 700.0 : x;
  const double shifted = bounded * std::numbers::log2e + shift;
  const double n = shifted - shift;
  const double r = (n * ln2_high - bounded) + n * ln2_low;
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(shifted);
  return (1 + r * series<1, 1, 13>(r)) * std::bit_cast<double>((std::uint64_t{1023} << 52) - (bits << 52));
}

/// sin(x) for |x| <= pi / 2, by its series
[[gnu::always_inline]] inline double short_sine(double x) { return x - x * (x * x * series<3, 2, 11>(-x * x)); }

/// cos(x) for |x| <= pi / 2, by its series
[[gnu::always_inline]] inline double short_cosine(double x)
{
  return 1 - x * x * (0.5 - x * x * series<4, 2, 10>(-x * x));
}
} // namespace mpm::materials
