#include "parallel/agreement.h"

#include <functional>

namespace mpm
{
std::string shared_failure(MPI_Comm comm, const std::string& failure)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  if (size == 1) // spares MPI, whose code is not in the cache where this is called once in many steps
    return failure;
  const int mine = failure.empty() ? size : rank;
  int first = size;
  MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, comm);
  if (first == size)
    return {};
  std::string text = failure;
  auto length = static_cast<int>(text.size());
  MPI_Bcast(&length, 1, MPI_INT, first, comm);
  text.resize(static_cast<std::size_t>(length));
  MPI_Bcast(text.data(), length, MPI_CHAR, first, comm);
  return text;
}

bool is_same_on_all_ranks(MPI_Comm comm, const std::string& text)
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  if (size == 1)
    return true;
  const std::size_t hash = std::hash<std::string>{}(text);
  const std::uint64_t mine[2] = {hash, ~hash};
  std::uint64_t smallest[2] = {};
  MPI_Allreduce(mine, smallest, 2, MPI_UINT64_T, MPI_MIN, comm);
  return smallest[0] == ~smallest[1];
}
} // namespace mpm
