#pragma once
/// @file
/// Values at ghost cells, and at those of their nodes that no owned cell touches, from the ranks that own the cells.

#include "mesh/mesh.h"
#include "parallel/messages.h"

#include <type_traits>

namespace mpm::parallel
{
/// Who gives whom which entries of an array.
struct Halo
{
  MPI_Comm comm = MPI_COMM_SELF;
  std::vector<Link> links; ///< by rising rank
};

/// Halos of a mesh: entries are cells, or nodes.
struct Halos
{
  Halo cells, nodes;
};

/// @note Collective
template <int D>
Halos make_halos(const Mesh<D>& mesh, MPI_Comm comm);

/// Replaces the values that this rank takes by those of the ranks that give them.
/// @param values  (entries, width) row-major
/// @note Collective over neighbours
void update(const Halo& halo, double* values, int width);

/// The same for a vector with one entry per cell or node that consists of doubles only; it may be empty.
template <class T>
void update(const Halo& halo, std::vector<T>& values)
{
  static_assert(std::is_trivially_copyable_v<T> && sizeof(T) % sizeof(double) == 0);
  constexpr std::size_t width =
      sizeof(T) / sizeof(double); // NOLINT(bugprone-sizeof-expression): T may be double itself
  update(halo, reinterpret_cast<double*>(values.data()), static_cast<int>(width));
}
} // namespace mpm::parallel
