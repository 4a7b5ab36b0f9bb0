#pragma once
/// @file
/// Errors that all ranks know of.

#include "base/types.h"

#include <mpi.h>

namespace mpm::parallel
{
/// @param failure  what went wrong on this rank, or nothing
/// @returns that of the lowest rank that has one; empty if nowhere anything failed
/// @note Collective
std::string shared_failure(MPI_Comm comm, const std::string& failure);

/// Does something that concerns this rank only; when it raises an InputError on any rank, all ranks raise it.
/// @note Collective; `work` must not be
template <class F>
void collectively(MPI_Comm comm, F&& work)
{
  std::string failure;
  try
  {
    work();
  }
  catch (const InputError& error)
  {
    failure = error.what();
  }
  if (const std::string text = shared_failure(comm, failure); !text.empty())
    throw InputError(text);
}
} // namespace mpm::parallel
