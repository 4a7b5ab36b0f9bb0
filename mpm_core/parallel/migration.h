#pragma once
/// @file
/// Particles that move into a cell of another rank.

#include "parallel/node_exchange.h"
#include "particles/particles.h"

#include <unordered_map>

namespace mpm
{
/// A particle that now lies in a ghost cell.
struct Leaver
{
  Index particle;
  Index ghost_cell;
};

/// Local number of each owned cell, by its global number.
template <int D>
std::unordered_map<GlobalIndex, Index> owned_cell_numbers(const Mesh<D>& mesh);

/// Sends leavers, with all their columns, to the ranks that own their cells, takes them out here, and appends those that
/// arrive. One packed message per neighbour.
/// @param leavers  sorted by particle
/// @param outflow  particles to take out without sending them, sorted
/// @returns number of particles that arrived; they are the last ones
/// @throws RunError a particle whose cell belongs to a rank that shares no node with this one
/// @note Collective over neighbours
template <int D>
Index migrate(const Mesh<D>& mesh, const std::unordered_map<GlobalIndex, Index>& cell_numbers,
              const NodeExchange& exchange, std::span<const Leaver> leavers,
              std::span<const Index> outflow, Particles<D>& particles);
} // namespace mpm
