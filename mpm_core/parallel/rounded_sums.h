#pragma once
/// @file
/// Sums whose result does not depend on the order of their terms, nor on which rank adds which of them.
///
/// Terms are rounded to multiples of a unit that follows from the largest of them, so coarse that all partial sums are
/// multiples of it with at most 53 bits: additions are then exact (pre-rounding; Demmel & Nguyen 2013, section 3). The
/// sum of n terms is off by at most n 2^-42 of the largest one.

#include "parallel/node_exchange.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <vector>

namespace mpm::parallel
{
/// So many terms can be added, far more than there are cells around a node or particles in a cell.
inline constexpr int most_rounded_terms = 1024;

/// A number that rounds terms when it is added to them and taken off again.
/// @param largest  no term is larger in magnitude
inline double rounding(double largest)
{
  constexpr std::uint64_t exponent_bits = 0x7ff0000000000000;
  // 2^e <= largest < 2^(e + 1) times 1.5 n: 1.5 keeps the sum with a term of either sign between the same powers of two
  const double power = std::bit_cast<double>(std::bit_cast<std::uint64_t>(largest) & exponent_bits);
  return 3.0 * most_rounded_terms * power;
}

/// Numbers of a struct that has doubles only.
template <class T>
using NumbersOf = std::array<double, sizeof(T) / sizeof(double)>;

/// Raises each number of `largest` to the magnitude of that of a term.
template <class T>
inline void keep_largest(const T& term, T& largest)
{
  const auto terms = std::bit_cast<NumbersOf<T>>(term);
  auto numbers = std::bit_cast<NumbersOf<T>>(largest);
  for (std::size_t k = 0; k < numbers.size(); ++k)
    numbers[k] = std::abs(terms[k]) <= numbers[k] ? numbers[k] : std::abs(terms[k]); // so that NaN is kept
  largest = std::bit_cast<T>(numbers);
}

/// Adds a term, rounded for a sum whose largest term is given.
template <class T>
inline void add_rounded(const T& term, const T& largest, T& sum)
{
  const auto terms = std::bit_cast<NumbersOf<T>>(term), bounds = std::bit_cast<NumbersOf<T>>(largest);
  auto numbers = std::bit_cast<NumbersOf<T>>(sum);
  for (std::size_t k = 0; k < numbers.size(); ++k)
  {
    const double by = rounding(bounds[k]);
    numbers[k] += (terms[k] + by) - by;
  }
  sum = std::bit_cast<T>(numbers);
}

/// Adds a term as it is.
template <class T>
inline void add_plainly(const T& term, T& sum)
{
  constexpr std::size_t size = NumbersOf<T>{}.size();
  if constexpr (size <= 4) // copies stay in registers
  {
    const auto terms = std::bit_cast<NumbersOf<T>>(term);
    auto numbers = std::bit_cast<NumbersOf<T>>(sum);
    for (std::size_t k = 0; k < size; ++k)
      numbers[k] += terms[k];
    sum = std::bit_cast<T>(numbers);
  }
  else // copies of many numbers go through memory: a tenth more instructions of the sums at nodes
  {
    const auto* terms = reinterpret_cast<const double*>(&term);
    auto* numbers = reinterpret_cast<double*>(&sum);
    for (std::size_t k = 0; k < size; ++k)
      numbers[k] += terms[k];
  }
}

/// Adds terms of this rank to sums at nodes; rounded where the exchange asks for reproducible sums, which must be zero
/// before and which `sum_shared` then adds up exactly.
/// @param sum_of     a sum by its number; a callable Index -> T&
/// @param each_term  calls its argument, a callable (Index sum, const T& term), with each term, each time alike
/// @param per_node   sums of a node, whose numbers follow each other
/// @note Collective over neighbours where sums are reproducible
template <class T, class SumOf, class EachTerm>
void sum_at_nodes(NodeExchange& exchange, SumOf&& sum_of, EachTerm&& each_term, int per_node = 1)
{
  if (!exchange.reproducible)
    return each_term([&sum_of](Index sum, const T& term) { add_plainly(term, sum_of(sum)); });
  std::vector<T> largest(exchange.owned.size() * static_cast<std::size_t>(per_node));
  each_term([&largest](Index sum, const T& term) { keep_largest(term, largest[static_cast<std::size_t>(sum)]); });
  max_shared(exchange, largest, per_node);
  each_term([&](Index sum, const T& term) { add_rounded(term, largest[static_cast<std::size_t>(sum)], sum_of(sum)); });
}
} // namespace mpm::parallel
