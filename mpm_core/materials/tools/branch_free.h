#pragma once
/// @file
/// Elementary functions without branches and calls: loops over points that use them vectorise, which those of the
/// standard library prevent.

#include <bit>
#include <cstdint>
#include <numbers>

namespace mpm::materials
{
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
  double sum = 1;
#pragma GCC unroll 13
  for (int k = 13; k > 0; --k)
    sum = 1 + sum * r * (1.0 / k);
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(shifted);
  return sum * std::bit_cast<double>((std::uint64_t{1023} << 52) - (bits << 52));
}

/// sin(x) for |x| <= pi / 2, by its series
[[gnu::always_inline]] inline double short_sine(double x)
{
  double sum = 1;
#pragma GCC unroll 11
  for (int k = 11; k > 0; --k)
    sum = 1 - sum * (x * x) * (1.0 / (2 * k * (2 * k + 1)));
  return x * sum;
}

/// cos(x) for |x| <= pi / 2, by its series
[[gnu::always_inline]] inline double short_cosine(double x)
{
  double sum = 1;
#pragma GCC unroll 11
  for (int k = 11; k > 0; --k)
    sum = 1 - sum * (x * x) * (1.0 / (2 * k * (2 * k - 1)));
  return sum;
}
} // namespace mpm::materials
