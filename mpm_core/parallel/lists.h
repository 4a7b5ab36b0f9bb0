#pragma once
/// @file
/// Lists of numbers between all ranks.

#include "base/types.h"

#include <mpi.h>

namespace mpm::parallel
{
/// Sends each rank its list and returns the lists received, by sending rank.
/// @param send  one list for each rank
/// @note Collective
std::vector<std::vector<GlobalIndex>> exchanged(const std::vector<std::vector<GlobalIndex>>& send, MPI_Comm comm);
} // namespace mpm::parallel
