#pragma once
/// @file
/// What ranks send each other: values along links, lists of numbers, and a directory of items by their global numbers.

#include "base/types.h"

#include <mpi.h>

#include <span>

namespace mpm::parallel
{
/// Entries of an array that this rank gives to another one, and those that it takes from there; each list has the same
/// length and order on both sides.
struct Link
{
  int rank;
  std::vector<Index> give, take;
  mutable std::vector<double> sent = {}, received = {}; ///< scratch: values of the last exchange
};

/// Sends the values that this rank gives, and receives those that it takes into `received`. One message per link.
/// @param values  (entries, width) row-major
/// @note Collective over the ranks of the links
void exchange_values(std::span<const Link> links, const double* values, int width, MPI_Comm comm);

/// Sends each rank its list and returns the lists received, by sending rank.
/// @param send  one list for each rank
/// @note Collective
std::vector<std::vector<GlobalIndex>> exchange_lists(const std::vector<std::vector<GlobalIndex>>& send, MPI_Comm comm);

/// A rank that has an item, and the row of the item there.
struct Holder
{
  int rank;
  GlobalIndex row;
};

/// Finds items by their global numbers; rank (number mod size) keeps the directory.
/// @param numbers  global numbers of this rank's items
/// @param rows     what is said of each of these items, such as its row
/// @param wanted   global numbers of the items to find
/// @returns holders of each wanted item, by rising rank; none where no rank has it
/// @note Collective
std::vector<std::vector<Holder>> find_holders(std::span<const GlobalIndex> numbers, std::span<const GlobalIndex> rows,
                                              std::span<const GlobalIndex> wanted, MPI_Comm comm);

/// This rank's rows in an array that all ranks hold together, by rising rank.
struct RowSlice
{
  GlobalIndex before = 0; ///< rows on lower ranks
  GlobalIndex local = 0;
  GlobalIndex total = 0;
};

/// @note Collective
RowSlice row_slice(MPI_Comm comm, std::size_t local);
} // namespace mpm::parallel
