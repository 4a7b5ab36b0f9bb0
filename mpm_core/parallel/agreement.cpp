#include "parallel/agreement.h"

namespace mpm::parallel
{
std::string shared_failure(MPI_Comm comm, const std::string& failure)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  if (size == 1) // spares MPI, whose code is not in the cache where this is called once in many steps
    return failure;
  int first = failure.empty() ? size : rank;
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == size)
    return {};
  std::string text = failure;
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, first, comm);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, first, comm);
  return text;
}
} // namespace mpm::parallel
