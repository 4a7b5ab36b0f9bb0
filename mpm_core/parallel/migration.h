#pragma once
/// @file
/// Particles that move into a cell of another rank.

#include "parallel/node_exchange.h"
#include "particles/particles.h"

#include <unordered_map>

namespace mpm::parallel
{
/// A particle that now lies in a cell of another rank.
struct MigratingParticle
{
  Index particle;
  GlobalIndex cell; ///< over all ranks
  int rank;         ///< that owns the cell
};

/// All that leaves this rank at once.
struct Departures
{
  std::span<const MigratingParticle> migrating;
  std::span<const Index> outflow; ///< particles to take out without sending them
  /// Ranks beyond the neighbours with which particles are exchanged; they must name each other. By rising rank.
  std::span<const int> far_partners;
};

/// Makes the columns of each optional field that some rank has.
/// @note Collective
template <int D>
void agree_on_fields(Particles<D>& particles, MPI_Comm comm);

/// Local number of each owned cell, by its global number.
template <int D>
std::unordered_map<GlobalIndex, Index> owned_cell_numbers(const Mesh<D>& mesh);

/// Sends migrating, with all their columns, to the ranks that own their cells, takes them out here, and appends those
/// that arrive, by rising rank. One packed message per neighbour and far partner.
/// @param cell_numbers  of this rank's owned cells, as `owned_cell_numbers` gives them
/// @pre The ranks of migrating are neighbours or far partners
/// @returns number of particles that arrived; they are the last ones
/// @note Collective over neighbours and far partners
template <int D>
Index migrate(const std::unordered_map<GlobalIndex, Index>& cell_numbers, const NodeExchange& exchange,
              const Departures& departures, Particles<D>& particles);
} // namespace mpm::parallel
