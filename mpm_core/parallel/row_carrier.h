#pragma once
/// @file
/// Rows of numbers from ranks that have them to ranks that want them.

#include "base/types.h"

#include <mpi.h>

#include <span>

namespace mpm::parallel
{
/// Carries rows of numbers from ranks that have them to those that want them, as often as their values change.
class RowCarrier
{
public:
  /// @param comm   must outlive the object
  /// @param ranks  which have the rows that this rank wants
  /// @param rows   of the values there
  /// @note Collective
  RowCarrier(MPI_Comm comm, std::span<const std::int64_t> ranks, std::span<const std::int64_t> rows);

  std::size_t n_wanted() const { return _order.size(); } ///< rows

  /// A row of this rank's values that a rank wants.
  struct Given
  {
    std::int64_t row;
    std::int64_t wanted_as; ///< its number among the wanted rows of all ranks, by rising rank
  };
  std::span<const Given> given() const { return _given; }

  /// @param width  numbers per row
  /// @param pack   puts a row of this rank's values somewhere: (row, first of `width` numbers)
  /// @return the wanted rows, row-major; valid until the next call
  /// @note Collective
  template <class Pack>
  std::span<const double> carry(std::size_t width, Pack&& pack)
  {
    _sent.resize(_given.size() * width);
    for (std::size_t i = 0; i < _given.size(); ++i)
      pack(static_cast<std::size_t>(_given[i].row), _sent.data() + i * width);
    exchange(width);
    return _wanted;
  }

private:
  void exchange(std::size_t width);

  MPI_Comm _comm;
  std::vector<int> _n_given, _n_taken; ///< rows to and from each rank
  std::vector<Given> _given;           ///< rows to send, by rising rank
  std::vector<std::size_t> _order;     ///< which of the wanted ones come, likewise
  std::vector<double> _sent, _came, _wanted;
};
} // namespace mpm::parallel
