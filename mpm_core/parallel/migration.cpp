#include "parallel/migration.h"

#include <algorithm>
#include <cstring>

namespace mpm
{
template <int D>
std::unordered_map<GlobalIndex, Index> owned_cell_numbers(const Mesh<D>& mesh)
{
  std::unordered_map<GlobalIndex, Index> numbers;
  for (Index c = 0; c < mesh.owned_cells; ++c)
    numbers[mesh.global_cells[c]] = c;
  return numbers;
}

template <int D>
Index migrate(const Mesh<D>& mesh, const std::unordered_map<GlobalIndex, Index>& cell_numbers,
              const NodeExchange& exchange, std::span<const Leaver> leavers,
              std::span<const Index> outflow, Particles<D>& particles)
{
  const std::size_t neighbours = exchange.neighbours.size();
  std::vector<std::vector<std::byte>> send(neighbours);
  std::vector<Index> numbers(outflow.begin(), outflow.end());
  // Columns are sent in the order of the list of fields; the cell goes by its global number, ahead of them.
  auto put = [](std::vector<std::byte>& buffer, const auto& value)
  {
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    buffer.insert(buffer.end(), bytes, bytes + sizeof(value));
  };
  for (const Leaver& leaver : leavers)
  {
    std::size_t to = 0;
    while (to < neighbours && exchange.neighbours[to].rank != mesh.cell_owners[leaver.ghost_cell])
      ++to;
    if (to == neighbours)
      throw RunError("particle " + std::to_string(particles.id[leaver.particle]) + " moved to rank " +
                     std::to_string(mesh.cell_owners[leaver.ghost_cell]) + ", which is no neighbour of rank " +
                     std::to_string(exchange.rank));
    put(send[to], mesh.global_cells[leaver.ghost_cell]);
    for_each_column(particles, [&](const char*, int, const auto& column)
                    { put(send[to], column.empty() ? std::remove_cvref_t<decltype(column[0])>{} : column[leaver.particle]); });
    numbers.push_back(leaver.particle);
  }

  std::vector<MPI_Request> requests(neighbours);
  const int tag = 2;
  for (std::size_t n = 0; n < neighbours; ++n)
    MPI_Isend(send[n].data(), static_cast<int>(send[n].size()), MPI_BYTE, exchange.neighbours[n].rank, tag,
              exchange.comm, &requests[n]);
  std::sort(numbers.begin(), numbers.end());
  remove<D>(particles, numbers);
  const Index before = particles.size();
  std::vector<std::byte> buffer;
  for (const auto& neighbour : exchange.neighbours)
  {
    MPI_Status status;
    MPI_Probe(neighbour.rank, tag, exchange.comm, &status);
    int length = 0;
    MPI_Get_count(&status, MPI_BYTE, &length);
    buffer.resize(static_cast<std::size_t>(length));
    MPI_Recv(buffer.data(), length, MPI_BYTE, neighbour.rank, tag, exchange.comm, MPI_STATUS_IGNORE);
    for (const std::byte* next = buffer.data(); next != buffer.data() + length;)
    {
      auto get = [&next](auto& value)
      {
        std::memcpy(&value, next, sizeof(value));
        next += sizeof(value);
      };
      const Index p = particles.size();
      resize(particles, p + 1);
      GlobalIndex cell;
      get(cell);
      for_each_column(particles,
                      [&](const char*, int, auto& column)
                      {
                        std::remove_cvref_t<decltype(column[0])> value;
                        get(value);
                        if (!column.empty())
                          column[p] = value;
                      });
      particles.cell[p] = cell_numbers.at(cell);
    }
  }
  MPI_Waitall(static_cast<int>(neighbours), requests.data(), MPI_STATUSES_IGNORE);
  return particles.size() - before;
}

#define INSTANTIATE(D)                                                                                                 \
  template std::unordered_map<GlobalIndex, Index> owned_cell_numbers(const Mesh<D>&);                                  \
  template Index migrate(const Mesh<D>&, const std::unordered_map<GlobalIndex, Index>&, const NodeExchange&,           \
                         std::span<const Leaver>, std::span<const Index>, Particles<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
