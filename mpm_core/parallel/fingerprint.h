#pragma once
/// @file
/// A number that tells meshes apart.

#include "mesh/mesh.h"

#include <mpi.h>

namespace mpm::parallel
{
/// A hash of points, cells, tags and numbers of a mesh; it does not depend on the partition.
/// @note Collective
template <int D>
std::uint64_t mesh_fingerprint(MPI_Comm comm, const Mesh<D>& mesh);
} // namespace mpm::parallel
