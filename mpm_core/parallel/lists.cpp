#include "parallel/lists.h"

namespace mpm::parallel
{
std::vector<std::vector<GlobalIndex>> exchanged(const std::vector<std::vector<GlobalIndex>>& send, MPI_Comm comm)
{
  const std::size_t size = send.size();
  std::vector<int> send_counts(size), counts(size), send_starts(size + 1, 0), starts(size + 1, 0);
  for (std::size_t r = 0; r < size; ++r)
    send_counts[r] = static_cast<int>(send[r].size());
  MPI_Alltoall(send_counts.data(), 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
  std::vector<GlobalIndex> packed;
  for (std::size_t r = 0; r < size; ++r)
  {
    packed.insert(packed.end(), send[r].begin(), send[r].end());
    send_starts[r + 1] = send_starts[r] + send_counts[r];
    starts[r + 1] = starts[r] + counts[r];
  }
  std::vector<GlobalIndex> data(static_cast<std::size_t>(starts[size]));
  MPI_Alltoallv(packed.data(), send_counts.data(), send_starts.data(), MPI_INT64_T, data.data(), counts.data(),
                starts.data(), MPI_INT64_T, comm);
  std::vector<std::vector<GlobalIndex>> received(size);
  for (std::size_t r = 0; r < size; ++r)
    received[r].assign(data.begin() + starts[r], data.begin() + starts[r + 1]);
  return received;
}
} // namespace mpm::parallel
