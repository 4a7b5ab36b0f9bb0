#include "parallel/migration.h"

#include <algorithm>
#include <cstring>

namespace mpm::parallel
{
namespace
{
using Bytes = std::vector<std::byte>;

/// Appends a particle's columns in the order of the schedule, and ahead of them its cell by its global number. The
/// initial value stands for an optional column that is absent.
template <int D>
void pack(const Particles<D>& particles, const MigratingParticle& migrant, Bytes& bytes)
{
  auto put = [&bytes](const auto& value)
  {
    const auto* data = reinterpret_cast<const std::byte*>(&value);
    bytes.insert(bytes.end(), data, data + sizeof(value));
  };
  put(migrant.cell);
  for_each_field(particles,
                 [&](const Field& field, const auto& columns)
                 {
                   for (const auto& column : columns_of(columns))
                     put(is_present(columns) ? column[migrant.particle]
                                             : static_cast<std::remove_cvref_t<decltype(column[0])>>(field.initial));
                 });
}

/// Appends the particles that a message holds, and the columns of optional fields that one of them has a value in.
template <int D>
void unpack(const Bytes& bytes, const std::unordered_map<GlobalIndex, Index>& cell_numbers, Particles<D>& particles)
{
  const std::byte* next = bytes.data();
  auto get = [&next](auto& value)
  {
    std::memcpy(&value, next, sizeof(value));
    next += sizeof(value);
  };
  while (next != bytes.data() + bytes.size())
  {
    const Index p = particles.size();
    resize(particles, p + 1);
    GlobalIndex cell;
    get(cell);
    const auto get_entry = [&](const Field& field, auto& columns)
    {
      for (auto& column : columns_of(columns))
      {
        std::remove_cvref_t<decltype(column[0])> value;
        get(value);
        if constexpr (is_optional<std::remove_cvref_t<decltype(columns)>>)
        {
          if (!columns.present && value == field.initial)
            continue;
          require(columns, particles.id.size(), field.initial);
        }
        column[p] = value;
      }
    };
    for_each_field(particles, get_entry);
    particles.cell[p] = cell_numbers.at(cell);
  }
}

/// Neighbours and far partners, by rising rank.
std::vector<int> partners_of(const NodeExchange& exchange, std::span<const int> far_partners)
{
  std::vector<int> ranks(far_partners.begin(), far_partners.end());
  for (const auto& neighbour : exchange.neighbours)
    ranks.push_back(neighbour.rank);
  std::sort(ranks.begin(), ranks.end());
  ranks.erase(std::unique(ranks.begin(), ranks.end()), ranks.end());
  return ranks;
}
} // namespace

template <int D>
void agree_on_fields(Particles<D>& particles, MPI_Comm comm)
{
  for_each_field(particles,
                 [&](const Field& field, auto& columns)
                 {
                   if constexpr (is_optional<std::remove_cvref_t<decltype(columns)>>)
                   {
                     int present = columns.present;
                     MPI_Allreduce(MPI_IN_PLACE, &present, 1, MPI_INT, MPI_MAX, comm);
                     if (present)
                       require(columns, particles.id.size(), field.initial);
                   }
                 });
}

template <int D>
std::unordered_map<GlobalIndex, Index> owned_cell_numbers(const Mesh<D>& mesh)
{
  std::unordered_map<GlobalIndex, Index> numbers;
  for (Index c = 0; c < mesh.owned_cells; ++c)
    numbers[mesh.global_cells[c]] = c;
  return numbers;
}

template <int D>
Index migrate(const std::unordered_map<GlobalIndex, Index>& cell_numbers, const NodeExchange& exchange,
              const Departures& departures, Particles<D>& particles)
{
  const std::vector<int> partners = partners_of(exchange, departures.far_partners);
  std::vector<Bytes> send(partners.size());
  std::vector<Index> numbers(departures.outflow.begin(), departures.outflow.end());
  for (const MigratingParticle& migrant : departures.migrating)
  {
    const auto to = std::lower_bound(partners.begin(), partners.end(), migrant.rank) - partners.begin();
    pack<D>(particles, migrant, send[static_cast<std::size_t>(to)]);
    numbers.push_back(migrant.particle);
  }
  std::vector<MPI_Request> requests(partners.size());
  const int tag = 2;
  for (std::size_t n = 0; n < partners.size(); ++n)
    MPI_Isend(send[n].data(), static_cast<int>(send[n].size()), MPI_BYTE, partners[n], tag, exchange.comm,
              &requests[n]);
  std::sort(numbers.begin(), numbers.end());
  remove<D>(particles, numbers);

  const Index before = particles.size();
  Bytes bytes;
  for (int partner : partners)
  {
    MPI_Status status;
    MPI_Probe(partner, tag, exchange.comm, &status);
    int length = 0;
    MPI_Get_count(&status, MPI_BYTE, &length);
    bytes.resize(static_cast<std::size_t>(length));
    MPI_Recv(bytes.data(), length, MPI_BYTE, partner, tag, exchange.comm, MPI_STATUS_IGNORE);
    unpack<D>(bytes, cell_numbers, particles);
  }
  MPI_Waitall(static_cast<int>(partners.size()), requests.data(), MPI_STATUSES_IGNORE);
  return particles.size() - before;
}

#define INSTANTIATE(D)                                                                                                 \
  template void agree_on_fields(Particles<D>&, MPI_Comm);                                                              \
  template std::unordered_map<GlobalIndex, Index> owned_cell_numbers(const Mesh<D>&);                                  \
  template Index migrate(const std::unordered_map<GlobalIndex, Index>&, const NodeExchange&, const Departures&,        \
                         Particles<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::parallel
