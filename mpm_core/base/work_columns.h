#pragma once
/// @file
/// Work arrays for a block of points, of fixed size, on the stack.

#include <array>
#include <bit>
#include <cstddef>

namespace mpm::base
{
/// Points handled at a time: their work arrays stay in the first-level cache
inline constexpr std::size_t block_size = 256;

template <class T>
using WorkColumn = std::array<T, block_size>;

/// One value of type T per point of a block, kept as one column per member, so that a loop over points vectorises.
/// T is a struct whose members are all as wide as a double.
template <class T>
class WorkColumns
{
public:
  T at(std::size_t i) const
  {
    Members members;
    for (std::size_t k = 0; k < width; ++k)
      members[k] = _columns[k][i];
    return std::bit_cast<T>(members);
  }

  void set(std::size_t i, const T& value)
  {
    const auto members = std::bit_cast<Members>(value);
    for (std::size_t k = 0; k < width; ++k)
      _columns[k][i] = members[k];
  }

  /// The column of member k
  WorkColumn<double>& column(std::size_t k) { return _columns[k]; }
  const WorkColumn<double>& column(std::size_t k) const { return _columns[k]; }

private:
  static constexpr std::size_t width = sizeof(T) / sizeof(double);
  using Members = std::array<double, width>;
  std::array<WorkColumn<double>, width> _columns;
};
} // namespace mpm::base
