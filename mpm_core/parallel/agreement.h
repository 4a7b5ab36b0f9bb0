#pragma once
/// @file
/// Errors that all ranks know of.

#include "base/types.h"

#include <mpi.h>

namespace mpm
{
/// The text of the lowest rank that has one, on all ranks; empty if nowhere anything failed.
/// @param failure  what went wrong on this rank, or nothing
/// @note Collective
std::string shared_failure(MPI_Comm comm, const std::string& failure);

/// Whether all ranks give the same text; different ones would make ranks wait for each other for ever.
/// @note Collective
bool is_same_on_all_ranks(MPI_Comm comm, const std::string& text);

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
} // namespace mpm
