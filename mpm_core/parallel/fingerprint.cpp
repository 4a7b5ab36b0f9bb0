#include "parallel/fingerprint.h"

#include <bit>

namespace mpm::parallel
{
namespace
{
/// Scrambles a word so that each of its bits changes about half of the result's (splitmix64; Steele, Lea & Flood 2014).
std::uint64_t mixed(std::uint64_t z)
{
  z += 0x9E3779B97F4A7C15U;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31);
}
} // namespace

template <int D>
std::uint64_t mesh_fingerprint(MPI_Comm comm, const Mesh<D>& mesh)
{
  auto point_hash = [&](Index node)
  {
    std::uint64_t hash = 0;
    for (double x : mesh.points[node])
      hash = mixed(hash ^ std::bit_cast<std::uint64_t>(x + 0.0)); // + 0.0 makes one zero of the two
    return hash;
  };
  // Sums, because neither the order of cells nor that of a cell's vertices is the same on all partitions.
  std::uint64_t sum = 0;
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    std::uint64_t cell = 0;
    for (int k = 0; k <= D; ++k)
    {
      const std::uint64_t point = point_hash(mesh.cells[c][k]);
      cell += mixed(point) + mixed(point ^ mixed(static_cast<std::uint64_t>(mesh.facet_tags[c][k])));
    }
    cell = mixed(cell ^ static_cast<std::uint64_t>(mesh.cell_tags[c]));
    sum += mixed(cell ^ mixed(static_cast<std::uint64_t>(mesh.global_cells[c])));
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_UINT64_T, MPI_SUM, comm);
  return sum;
}

template std::uint64_t mesh_fingerprint(MPI_Comm, const Mesh<2>&);
template std::uint64_t mesh_fingerprint(MPI_Comm, const Mesh<3>&);
} // namespace mpm::parallel
