#include "parallel/messages.h"

#include <algorithm>
#include <unordered_map>

namespace mpm::parallel
{
void exchange_values(std::span<const Link> links, const double* values, int width, MPI_Comm comm)
{
  const auto w = static_cast<std::size_t>(width);
  const int tag = 1;
  std::vector<MPI_Request> requests;
  requests.reserve(2 * links.size());
  for (const Link& link : links)
  {
    link.received.resize(link.take.size() * w);
    MPI_Irecv(link.received.data(), static_cast<int>(link.received.size()), MPI_DOUBLE, link.rank, tag, comm,
              &requests.emplace_back());
  }
  for (const Link& link : links)
  {
    link.sent.resize(link.give.size() * w);
    for (std::size_t k = 0; k < link.give.size(); ++k)
      std::copy_n(values + static_cast<std::size_t>(link.give[k]) * w, w, &link.sent[k * w]);
    MPI_Isend(link.sent.data(), static_cast<int>(link.sent.size()), MPI_DOUBLE, link.rank, tag, comm,
              &requests.emplace_back());
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);
}

std::vector<std::vector<GlobalIndex>> exchange_lists(const std::vector<std::vector<GlobalIndex>>& send, MPI_Comm comm)
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

std::vector<std::vector<Holder>> find_holders(std::span<const GlobalIndex> numbers, std::span<const GlobalIndex> rows,
                                              std::span<const GlobalIndex> wanted, MPI_Comm comm)
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  const auto keeper = [size](GlobalIndex number) { return static_cast<std::size_t>((number % size + size) % size); };
  using Lists = std::vector<std::vector<GlobalIndex>>;
  Lists entries(static_cast<std::size_t>(size)), requests(entries), replies(entries); // number, row, ...
  for (std::size_t k = 0; k < numbers.size(); ++k)
    entries[keeper(numbers[k])].insert(entries[keeper(numbers[k])].end(), {numbers[k], rows[k]});
  for (GlobalIndex number : wanted)
    requests[keeper(number)].push_back(number);

  std::unordered_map<GlobalIndex, std::vector<Holder>> directory;
  const Lists kept = exchange_lists(entries, comm), asked = exchange_lists(requests, comm);
  for (std::size_t r = 0; r < kept.size(); ++r)
    for (std::size_t k = 0; k < kept[r].size(); k += 2)
      directory[kept[r][k]].push_back({static_cast<int>(r), kept[r][k + 1]});
  for (std::size_t r = 0; r < asked.size(); ++r)
    for (GlobalIndex number : asked[r]) // how many there are, then rank, row, ...
    {
      const auto found = directory.find(number);
      replies[r].push_back(found == directory.end() ? 0 : static_cast<GlobalIndex>(found->second.size()));
      if (found != directory.end())
        for (const Holder& holder : found->second)
          replies[r].insert(replies[r].end(), {holder.rank, holder.row});
    }

  const Lists returned = exchange_lists(replies, comm);
  std::vector<std::size_t> next(returned.size(), 0);
  std::vector<std::vector<Holder>> holders(wanted.size());
  for (std::size_t k = 0; k < wanted.size(); ++k)
  {
    const auto& list = returned[keeper(wanted[k])];
    std::size_t& at = next[keeper(wanted[k])];
    for (GlobalIndex left = list[at++]; left > 0; --left, at += 2)
      holders[k].push_back({static_cast<int>(list[at]), list[at + 1]});
  }
  return holders;
}

RowSlice row_slice(MPI_Comm comm, std::size_t local)
{
  RowSlice rows;
  rows.local = static_cast<GlobalIndex>(local);
  GlobalIndex up_to_here = 0;
  MPI_Scan(&rows.local, &up_to_here, 1, MPI_INT64_T, MPI_SUM, comm);
  rows.before = up_to_here - rows.local;
  MPI_Allreduce(&rows.local, &rows.total, 1, MPI_INT64_T, MPI_SUM, comm);
  return rows;
}
} // namespace mpm::parallel
