#include "parallel/agreement.h"

#include <functional>

namespace mpm::parallel
{
Agreement agreement(MPI_Comm comm, const std::string& failure, const std::string& text)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  if (size == 1) // spares MPI, whose code is not in the cache where this is called once in many steps
    return {failure, true};
  const std::uint64_t hash = std::hash<std::string>{}(text);
  std::uint64_t least[3] = {static_cast<std::uint64_t>(failure.empty() ? size : rank), hash, ~hash};
  MPI_Allreduce(MPI_IN_PLACE, least, 3, MPI_UINT64_T, MPI_MIN, comm);
  const auto first = static_cast<int>(least[0]);
  Agreement found{failure, least[1] == ~least[2]};
  if (first == size)
    return found;
  auto length = static_cast<int>(failure.size());
  MPI_Bcast(&length, 1, MPI_INT, first, comm);
  found.failure.resize(static_cast<std::size_t>(length));
  MPI_Bcast(found.failure.data(), length, MPI_CHAR, first, comm);
  return found;
}
} // namespace mpm::parallel
