#pragma once
/// @file
/// The complete state of a run in one parallel HDF5 file.
///
/// Layout: `particles/NAME` has a row per particle for each field of the one schedule, `cell` by its number over all
/// ranks; `cells/NAME` are tables with some rows per rank; `ranks/NAME` have one row per rank, among them the numbers
/// of rows of the others; the attribute `description` is a text that says what the run is. Rows are by rising rank. The
/// first 512 bytes are the file's stamp.

#include "base/table.h"
#include "parallel/node_exchange.h"
#include "particles/particles.h"

#include <filesystem>

namespace mpm::io
{
/// The parts of a run's state beside the particles.
struct StateTables
{
  std::vector<Table> ranks; ///< one row each
  std::vector<Table> cells; ///< any number of rows; the first number is the cell over all ranks
};

/// Writes a checkpoint aside, sees to it that it is whole and on the disk, then renames it; whatever was there stays
/// until then.
/// @pre agree_on_fields(particles) has been called
/// @throws RunError on all ranks, with path and reason; nothing is left behind
/// @note Collective
template <int D>
void write_checkpoint(MPI_Comm comm, const std::filesystem::path& path, const Mesh<D>& mesh,
                      const Particles<D>& particles, const StateTables& state, const std::string& description);

/// The description in a checkpoint whose stamp is right.
/// @throws RunError on all ranks, with path and reason
/// @note Collective
std::string checkpoint_description(MPI_Comm comm, const std::filesystem::path& path);

/// A table for `StateTables::cells` that says which cells each rank owns, and in which order. Needed where the mesh has
/// been repartitioned since the run began, so that a restart can take the same partition.
template <int D>
Table owned_cells_table(const Mesh<D>& mesh);

/// The cells of this rank in that table.
/// @pre The checkpoint has it, and is of as many ranks as now
/// @throws RunError on all ranks, with path and reason
/// @note Collective
std::vector<GlobalIndex> checkpoint_cells(MPI_Comm comm, const std::filesystem::path& path);

template <int D>
struct Checkpoint
{
  Particles<D> particles;
  /// The partition is that of the file: particles are in its order and `state` is this rank's. Otherwise particles are
  /// in the order of their numbers, `state.ranks` has the rows of all ranks of the file, and `state.cells` is empty.
  bool same_parts;
  StateTables state;
};

/// Reads a checkpoint of this mesh, each rank the particles in its cells.
/// @param fields     particles with the fields that the file's are to have, state variables included
/// @param materials  number of laws
/// @param expected   names and widths of the tables to read; those of cells may be missing in the file
/// @throws RunError on all ranks, with path and reason
/// @note Collective
template <int D>
Checkpoint<D> read_checkpoint(const NodeExchange& exchange, const std::filesystem::path& path, const Mesh<D>& mesh,
                              const Particles<D>& fields, std::size_t materials, const StateTables& expected);

/// A number that depends on all nodes, cells and tags of a mesh, and not on its partition.
/// @note Collective
template <int D>
std::uint64_t mesh_fingerprint(MPI_Comm comm, const Mesh<D>& mesh);
} // namespace mpm::io
