#include "parallel/row_carrier.h"

#include "parallel/row_slice.h"

#include <algorithm>
#include <numeric>

namespace mpm::parallel
{
namespace
{
std::vector<int> times(const std::vector<int>& counts, std::size_t width)
{
  std::vector<int> product(counts);
  for (int& count : product)
    count *= static_cast<int>(width);
  return product;
}

std::vector<int> starts(const std::vector<int>& counts)
{
  std::vector<int> before(counts.size());
  std::exclusive_scan(counts.begin(), counts.end(), before.begin(), 0);
  return before;
}
} // namespace

RowCarrier::RowCarrier(MPI_Comm comm, std::span<const std::int64_t> ranks, std::span<const std::int64_t> rows)
    : _comm(comm), _order(ranks.size())
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  _n_given.resize(static_cast<std::size_t>(size));
  _n_taken.resize(static_cast<std::size_t>(size));
  for (const std::int64_t rank : ranks)
    ++_n_taken[static_cast<std::size_t>(rank)];
  MPI_Alltoall(_n_taken.data(), 1, MPI_INT, _n_given.data(), 1, MPI_INT, comm);
  std::iota(_order.begin(), _order.end(), std::size_t{0});
  std::ranges::stable_sort(_order, {}, [&](std::size_t i) { return ranks[i]; });
  const GlobalIndex before = row_slice(comm, _order.size()).before;
  std::vector<Given> asked(rows.size());
  std::ranges::transform(_order, asked.begin(),
                         [&](std::size_t i) {
                           return Given{rows[i], before + static_cast<std::int64_t>(i)};
                         });
  _given.resize(static_cast<std::size_t>(std::reduce(_n_given.begin(), _n_given.end())));
  static_assert(sizeof(Given) == 2 * sizeof(std::int64_t));
  const std::vector<int> taken = times(_n_taken, 2), given = times(_n_given, 2);
  MPI_Alltoallv(asked.data(), taken.data(), starts(taken).data(), MPI_INT64_T, _given.data(), given.data(),
                starts(given).data(), MPI_INT64_T, comm);
}

void RowCarrier::exchange(std::size_t width)
{
  _came.resize(_order.size() * width);
  _wanted.resize(_order.size() * width);
  const std::vector<int> given = times(_n_given, width), taken = times(_n_taken, width);
  MPI_Alltoallv(_sent.data(), given.data(), starts(given).data(), MPI_DOUBLE, _came.data(), taken.data(),
                starts(taken).data(), MPI_DOUBLE, _comm);
  for (std::size_t i = 0; i < _order.size(); ++i)
    std::copy_n(_came.data() + i * width, width, _wanted.data() + _order[i] * width);
}
} // namespace mpm::parallel
