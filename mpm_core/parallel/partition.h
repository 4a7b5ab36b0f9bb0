#pragma once
/// @file
/// Cutting a mesh into parts of equal weight.

#include "mesh/mesh.h"

#include <mpi.h>

#include <span>
#include <vector>

namespace mpm::parallel
{
/// Values of all cells that a rank knows, from those of the cells that it owns.
/// @param owned  one number for each owned cell
/// @returns one for each cell: the owned ones, then those of the ghosts, from their owners
/// @note Collective
template <int D>
std::vector<double> with_ghost_values(const Mesh<D>& mesh, std::span<const double> owned, MPI_Comm comm);

/// A part for each owned cell, by PT-SCOTCH on the graph of cells that share a facet: parts of about equal weight with
/// few facets between them (Chevalier & Pellegrini 2008, Parallel Computing 34). There are as many parts as ranks, and
/// they are the same each time.
/// @param weights  of the owned cells, positive
/// @throws RunError on all ranks when PT-SCOTCH fails, or the program was built without it
/// @note Collective
template <int D>
std::vector<Index> weighted_parts(const Mesh<D>& mesh, std::span<const GlobalIndex> weights, MPI_Comm comm);
} // namespace mpm::parallel
