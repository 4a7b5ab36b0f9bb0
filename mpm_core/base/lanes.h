#pragma once
/// @file
/// Kernels over a run of particles, a few at once, in vectors of constant length. With some ten particles in a cell,
/// the scalar remainder of a loop that the compiler vectorises would cost as much as all the rest. A function of `T` is
/// for one number (`double`) or for those of a few particles (`Lanes`), and rounds alike in both.

#include "base/types.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace mpm::base
{
/// Particles that a kernel treats at once: one vector register of AVX2, half of one of AVX-512, two of SSE2 or NEON.
/// With ten particles in a cell, eight at once would leave more lanes idle than they save instructions.
inline constexpr int lanes = 4;

/// One number of each of these particles. The compilers' own vectors (g++, clang++): plain arrays of constant length
/// are unrolled into scalars.
using Lanes [[gnu::vector_size(lanes * sizeof(double))]] = double;
/// Two numbers
using Pair [[gnu::vector_size(2 * sizeof(double))]] = double;
/// -1 where something holds, 0 elsewhere; what the comparison of two `Lanes` gives
using LaneMask [[gnu::vector_size(lanes * sizeof(double))]] = std::int64_t;

/// How many particles ahead memory is asked for: some more than a batch, whose columns are read one after another.
inline constexpr int particles_ahead = 320;

/// The entries of a column from here on.
inline Lanes load(const double* column)
{
  Lanes numbers;
  std::memcpy(&numbers, column, sizeof(Lanes));
  return numbers;
}

/// The same, or one entry
template <class T>
inline T load_as(const double* column)
{
  if constexpr (std::is_same_v<T, double>)
    return *column;
  else
    return load(column);
}

/// Writes them there.
inline void store(double number, double* column) { *column = number; }
inline void store(const Lanes& numbers, double* column) { std::memcpy(column, &numbers, sizeof(Lanes)); }

/// Entries of N columns
template <std::size_t N>
using Piece = std::array<Lanes, N>;

/// The entries from `first` on.
template <std::size_t N, class T>
inline Piece<N> load(const std::array<T*, N>& columns, Index first)
{
  Piece<N> piece;
  for (std::size_t k = 0; k < N; ++k)
    piece[k] = load(columns[k] + first);
  return piece;
}

/// Fewer entries than lanes, such as a particle out of cell order: the lanes beyond the last repeat it.
template <std::size_t N, class T>
inline Piece<N> load_few(const std::array<T*, N>& columns, Index first, Index last)
{
  Piece<N> piece;
  for (std::size_t k = 0; k < N; ++k)
    for (int l = 0; l < lanes; ++l)
      piece[k][l] = columns[k][std::min(first + l, last - 1)];
  return piece;
}

/// Calls `change(piece)` on the entries [first, last) of the columns, piece by piece, and writes them back. The last
/// piece reaches back over entries that the piece before it changes too: it is read before that, and gives them the
/// same values once more. (Masked stores would hold up the loads that follow them.)
/// @tparam asks_ahead  whether entries of a later run are asked for: a processor's own prefetching ends with each 4 KB.
///   In plane strain whole steps gain 4 % with 640,000 particles and 6 % with 2.5 million; in three dimensions, with
///   more to compute for each number, they lose 1 %.
template <bool asks_ahead, std::size_t N, class Change>
inline void change_lanes(const std::array<double*, N>& columns, Index first, Index last, Change&& change)
{
  if (last - first < lanes)
  {
    Piece<N> piece = load_few(columns, first, last);
    change(piece);
    for (std::size_t k = 0; k < N; ++k)
      for (int l = 0; l < lanes - 1; ++l) // of constant length, lest the compiler calls memcpy for so little
        if (first + l < last)
          columns[k][first + l] = piece[k][l];
    return;
  }
  const auto store_piece = [&columns](const Piece<N>& piece, Index to)
  {
    for (std::size_t k = 0; k < N; ++k)
      store(piece[k], columns[k] + to);
  };
  Piece<N> tail = load(columns, last - lanes);
  Index i = first;
  for (; i + lanes <= last; i += lanes)
  {
    Piece<N> piece = load(columns, i);
    if constexpr (asks_ahead)
      for (std::size_t k = 0; k < N; ++k)
        __builtin_prefetch(columns[k] + i + particles_ahead, 1);
    change(piece);
    store_piece(piece, i);
  }
  if (i == last)
    return;
  change(tail);
  store_piece(tail, last - lanes);
}

/// Calls `add(piece, mine)` on the entries [first, last) of the columns, piece by piece, each entry being `mine` once.
template <std::size_t N, class Add>
inline void add_lanes(const std::array<const double*, N>& columns, Index first, Index last, Add&& add)
{
  constexpr LaneMask number{0, 1, 2, 3};
  static_assert(lanes == 4);
  if (last - first < lanes)
    return add(load_few(columns, first, last), number < last - first);
  Index i = first;
  for (; i + lanes <= last; i += lanes)
    add(load(columns, i), number >= 0);
  if (i < last)
    add(load(columns, last - lanes), number >= lanes - (last - i));
}

/// `f` of a number, or of that of each lane
template <class T, class F>
inline T each(const T& a, F&& f)
{
  if constexpr (std::is_same_v<T, double>)
    return f(a);
  else
  {
    T results{};
    for (int l = 0; l < lanes; ++l)
      results[l] = f(a[l]);
    return results;
  }
}

/// Square root of a number or of each lane
template <class T>
inline T root(const T& a)
{
  return each(a, [](double x) { return std::sqrt(x); });
}

template <class T>
inline T absolute(const T& a)
{
  return a < 0 ? -a : a;
}

/// The larger of two numbers, the second where one is not a number
template <class T>
inline T larger(const T& a, const T& b)
{
  return a > b ? a : b;
}

/// The smaller of two numbers, the second where one is not a number
template <class T>
inline T smaller(const T& a, const T& b)
{
  return a < b ? a : b;
}

/// What the comparison of two T gives: `bool` or `LaneMask`
template <class T>
using Mask = decltype(T{} < T{});

inline bool any(bool mask) { return mask; }
inline bool any(const LaneMask& mask) { return (mask[0] | mask[1] | mask[2] | mask[3]) != 0; }

inline double sum(const Lanes& a)
{
  static_assert(lanes == 4);
  const Pair halves = __builtin_shufflevector(a, a, 0, 1) + __builtin_shufflevector(a, a, 2, 3);
  return halves[0] + halves[1];
}
} // namespace mpm::base
