#pragma once
/// @file
/// Errors that all ranks know of.

#include "base/types.h"

#include <mpi.h>

namespace mpm::parallel
{
/// What all ranks know of each other after one exchange.
struct Agreement
{
  std::string failure; ///< that of the lowest rank that has one; empty if nowhere anything failed
  bool same;           ///< all ranks gave the same text; different ones would make ranks wait for each other for ever
};

/// @param failure  what went wrong on this rank, or nothing
/// @param text     what must be the same on all ranks
/// @note Collective
Agreement agreement(MPI_Comm comm, const std::string& failure, const std::string& text);

/// @note Collective
inline std::string shared_failure(MPI_Comm comm, const std::string& failure)
{
  return agreement(comm, failure, {}).failure;
}

/// @note Collective
inline bool is_same_on_all_ranks(MPI_Comm comm, const std::string& text) { return agreement(comm, {}, text).same; }

/// The text of the InputError that something raises; empty if it raises none.
template <class F>
std::string input_error_of(F&& work)
{
  try
  {
    work();
  }
  catch (const InputError& error)
  {
    return error.what();
  }
  return {};
}

/// Does something that concerns this rank only; when it raises an InputError on any rank, all ranks raise it.
/// @note Collective; `work` must not be
template <class F>
void collectively(MPI_Comm comm, F&& work)
{
  if (const std::string text = shared_failure(comm, input_error_of(work)); !text.empty())
    throw InputError(text);
}
} // namespace mpm::parallel
