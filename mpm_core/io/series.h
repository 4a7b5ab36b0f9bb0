#pragma once
/// @file
/// Particles and background mesh over time, in HDF5 files with XDMF files beside them.

#include "io/series_file.h"

namespace mpm::io
{
/// What a frame says of this rank's particles.
struct ParticleFields
{
  OutputField position; ///< 2 or 3 components; m
  std::vector<OutputField> fields;
  std::vector<OutputIndexField> index_fields;
};

/// What a frame says of this rank's nodes and cells.
struct MeshFields
{
  std::vector<OutputField> nodes;
  std::vector<OutputField> cells;
};

/// Particles over time. Their number may change, and ranks may have none.
class ParticleSeries
{
public:
  ParticleSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage);

  /// Starts a frame.
  /// @param fields  must live until it is written
  /// @param wide    whether an index field has values that do not fit into 32 bits, on any rank
  void begin(double time, const ParticleFields& fields, const RowSlice& rows, const std::vector<bool>& wide);

  SeriesFile& file() { return _file; }

private:
  SeriesFile _file;
  XdmfData _vertices;   ///< the latest topology; written again only when the number of particles changes
  int _vertices_in = 0; ///< the frame that has it
  std::vector<std::int64_t> _numbers;
};

/// The background mesh, once, and fields on its nodes and cells over time.
class MeshSeries
{
public:
  /// Writes the mesh.
  /// @param dimension  2 (triangles) or 3 (tetrahedra)
  /// @param points     (n, dimension) nodes of this rank's cells; m. A node that several ranks give appears once for
  /// each.
  /// @param cells      (m, dimension + 1) rows of `points`, this rank's own cells only
  /// @param fixed      fields on the cells that are the same in all frames
  MeshSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage, int dimension,
             std::span<const double> points, std::span<const std::int64_t> cells,
             const std::vector<OutputField>& fixed);

  /// Starts a frame.
  /// @param fields  must live until it is written
  void begin(double time, const MeshFields& fields);

  SeriesFile& file() { return _file; }
  std::size_t n_nodes() const { return static_cast<std::size_t>(_nodes.local); }
  std::size_t n_cells() const { return static_cast<std::size_t>(_cells.local); }

private:
  SeriesFile _file;
  RowSlice _nodes;
  RowSlice _cells;
  std::string _grid; ///< XDMF of topology, geometry and fixed fields
};

/// What is to be written at one time.
struct Frame
{
  double time = 0;                     ///< s, finite
  ParticleSeries* particles = nullptr; ///< no particles are written if this is null
  ParticleFields particle_fields = {}; ///< the same names on all ranks, of as many rows as the position
  MeshSeries* mesh = nullptr;          ///< no mesh is written if this is null
  MeshFields mesh_fields = {};         ///< the same names on all ranks
  std::string failure = {};            ///< why this rank has no fields; empty if it has
};

/// @param error  why this rank has no fields; empty if it has
/// @param names  of its fields
/// @throws InputError on all ranks if a rank has none, or other ones
/// @note Collective
void require_same_fields(MPI_Comm comm, const std::string& error, const std::string& names);

/// Writes a frame, of particles and of the mesh at the same time.
/// @param comm  that of the series
/// @throws InputError if a rank has no fields, lengths do not match, names differ between ranks or are no plain words
/// @throws RunError if a file cannot be written, with path and reason
/// @note Collective
void write(MPI_Comm comm, const Frame& frame);
} // namespace mpm::io
