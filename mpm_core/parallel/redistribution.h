#pragma once
/// @file
/// Particles that lie on any rank, brought to the ranks that own their cells.

#include "parallel/migration.h"

namespace mpm::parallel
{
/// Sends each particle to the rank that owns its cell, wherever that is; afterwards the particles are in the order of
/// their numbers, so that it does not matter where they came from.
/// @param cells   number of each particle's cell over all ranks; the column `cell` is set from it
/// @param owners  rank that owns this cell, of each particle
/// @note Collective
template <int D>
void redistribute(const Mesh<D>& mesh, const NodeExchange& exchange, std::span<const GlobalIndex> cells,
                  std::span<const GlobalIndex> owners, Particles<D>& particles);
} // namespace mpm::parallel
