#include "parallel/far_search.h"

#include "mesh/search.h"

#include <algorithm>
#include <limits>

namespace mpm::parallel
{
namespace
{
/// How far the walk to a point has come; numbers of one type, so that ranks agree by taking the largest.
struct Walk
{
  GlobalIndex cell; ///< where the point is; or, when `under_way`, where the walk goes on
  GlobalIndex rank; ///< that owns this cell
  GlobalIndex exit_tag;
  GlobalIndex under_way;
};
constexpr int walk_width = sizeof(Walk) / sizeof(GlobalIndex);
/// Results of a rank for walks that started on other ranks.
constexpr GlobalIndex no_word = std::numeric_limits<GlobalIndex>::min();

/// More rounds than this are a walk that goes round in circles.
constexpr int longest_walk = 256;

template <int D>
struct Entry
{
  Vector<D> position;
  Walk walk;
  int origin;
};

template <int D>
Walk walked(const Mesh<D>& mesh, int rank, const Vector<D>& x, Index start)
{
  const Location found = walk_to_cell<D>(mesh, x, start);
  if (found.cell != none)
    return {mesh.global_cells[found.cell], mesh.cell_owners[found.cell], none, 0};
  if (mesh.cell_owners[found.exit_cell] != rank)
    return {mesh.global_cells[found.exit_cell], mesh.cell_owners[found.exit_cell], none, 1};
  return {none, none, mesh.facet_tags[found.exit_cell][found.exit_facet], 0};
}

/// The entries of all ranks, on all ranks.
template <int D>
std::vector<Entry<D>> gathered(const std::vector<Entry<D>>& own, const NodeExchange& exchange)
{
  const auto size = static_cast<std::size_t>(exchange.size);
  const int bytes = static_cast<int>(own.size() * sizeof(Entry<D>));
  std::vector<int> counts(size), starts(size, 0);
  MPI_Allgather(&bytes, 1, MPI_INT, counts.data(), 1, MPI_INT, exchange.comm);
  for (std::size_t r = 1; r < size; ++r)
    starts[r] = starts[r - 1] + counts[r - 1];
  std::vector<Entry<D>> all(static_cast<std::size_t>(starts.back() + counts.back()) / sizeof(Entry<D>));
  MPI_Allgatherv(own.data(), bytes, MPI_BYTE, all.data(), counts.data(), starts.data(), MPI_BYTE, exchange.comm);
  return all;
}

/// Carries the walks on, each on the rank that owns its cell, until all have ended.
template <int D>
void carry_on(const Mesh<D>& mesh, const std::unordered_map<GlobalIndex, Index>& owned_cells,
              const NodeExchange& exchange, std::vector<Entry<D>>& entries)
{
  std::vector<Walk> walks(entries.size());
  for (int round = 0; round < longest_walk; ++round)
  {
    if (std::none_of(entries.begin(), entries.end(), [](const auto& entry) { return entry.walk.under_way == 1; }))
      return;
    for (std::size_t k = 0; k < entries.size(); ++k)
    {
      const Walk& walk = entries[k].walk;
      walks[k] = walk;
      if (walk.under_way == 1)
        walks[k] = walk.rank == exchange.rank
                       ? walked<D>(mesh, exchange.rank, entries[k].position, owned_cells.at(walk.cell))
                       : Walk{no_word, no_word, no_word, no_word};
    }
    MPI_Allreduce(MPI_IN_PLACE, walks.data(), static_cast<int>(walks.size()) * walk_width, MPI_INT64_T, MPI_MAX,
                  exchange.comm);
    for (std::size_t k = 0; k < entries.size(); ++k)
      entries[k].walk = walks[k];
  }
  for (Entry<D>& entry : entries)
    if (entry.walk.under_way == 1)
      entry.walk = {none, none, none, 0};
}

/// Looks for the points whose walk ended outside in the bins of all ranks. Of several cells that hold a point the one
/// with the highest number takes it, on any partition.
template <int D>
void look_into_bins(const Mesh<D>& mesh, const NodeExchange& exchange, std::vector<Entry<D>>& entries)
{
  std::vector<GlobalIndex> cells(entries.size(), none), own, ranks(entries.size(), none);
  for (std::size_t k = 0; k < entries.size(); ++k)
    if (entries[k].walk.cell == none)
      if (const Index c = find_cell_in_bins<D>(mesh, entries[k].position); c != none && c < mesh.owned_cells)
        cells[k] = mesh.global_cells[c];
  own = cells;
  const int size = static_cast<int>(entries.size());
  MPI_Allreduce(MPI_IN_PLACE, cells.data(), size, MPI_INT64_T, MPI_MAX, exchange.comm);
  for (std::size_t k = 0; k < entries.size(); ++k)
    ranks[k] = own[k] == cells[k] ? exchange.rank : none;
  MPI_Allreduce(MPI_IN_PLACE, ranks.data(), size, MPI_INT64_T, MPI_MAX, exchange.comm);
  for (std::size_t k = 0; k < entries.size(); ++k)
    if (cells[k] != none)
      entries[k].walk = {cells[k], ranks[k], none, 0};
}
} // namespace

template <int D>
FarSearch find_far(const Mesh<D>& mesh, const std::unordered_map<GlobalIndex, Index>& owned_cells,
                   const NodeExchange& exchange, std::span<const LostPoint<D>> points)
{
  std::vector<Entry<D>> own;
  for (const LostPoint<D>& point : points)
    own.push_back({point.position, walked<D>(mesh, exchange.rank, point.position, point.start), exchange.rank});
  std::vector<Entry<D>> entries = gathered<D>(own, exchange);
  carry_on<D>(mesh, owned_cells, exchange, entries);
  look_into_bins<D>(mesh, exchange, entries);

  FarSearch search;
  for (const Entry<D>& entry : entries)
  {
    const auto [cell, rank, exit_tag, under_way] = entry.walk;
    if (entry.origin == exchange.rank)
      search.places.push_back({cell, static_cast<int>(rank), static_cast<Index>(exit_tag)});
    if (cell != none && entry.origin == exchange.rank)
      search.partners.push_back(static_cast<int>(rank));
    if (cell != none && rank == exchange.rank)
      search.partners.push_back(entry.origin);
  }
  std::sort(search.partners.begin(), search.partners.end());
  search.partners.erase(std::unique(search.partners.begin(), search.partners.end()), search.partners.end());
  return search;
}

#define INSTANTIATE(D)                                                                                                 \
  template FarSearch find_far<D>(const Mesh<D>&, const std::unordered_map<GlobalIndex, Index>&, const NodeExchange&,   \
                                 std::span<const LostPoint<D>>);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::parallel
