#pragma once
/// @file
/// Rows of arrays that lie on all ranks, numbered through.

#include "base/types.h"

#include <mpi.h>

namespace mpm::parallel
{
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
