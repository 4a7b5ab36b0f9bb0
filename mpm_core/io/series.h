#pragma once
/// @file
/// Particles and background mesh over time, in parallel HDF5 with an XDMF file beside it.

#include "io/hdf5_file.h"
#include "io/xdmf.h"

#include <variant>
#include <vector>

namespace mpm
{
/// One component of real values to write, where they are: every `stride`-th number from `first` on.
struct OutputColumn
{
  const double* first;
  std::size_t stride = 1;
  const double* minus = nullptr; ///< what is taken away from each, with the same stride; nothing if null
};

/// Real values to write, one row per particle, node or cell.
struct OutputField
{
  std::string name;
  std::size_t rows;
  std::vector<OutputColumn> columns; ///< one per component
};

/// The field of an array (n, components), row-major.
OutputField row_field(std::string name, std::span<const double> values, int components);

/// Whole numbers to write, one per particle, node or cell.
struct OutputIndexField
{
  std::string name;
  std::variant<std::span<const std::int64_t>, std::span<const std::int32_t>> values;
};

enum class Precision
{
  float32,
  float64
};

/// How values are stored.
struct Storage
{
  Precision precision = Precision::float32;
  int compression = 0; ///< level of deflate, 0 (none) to 9
};

/// The files PATH.h5 and PATH.xdmf of one series. ParaView, VTK and meshio open the XDMF file, also while the run goes
/// on and after it was killed: each frame is in the HDF5 file before the XDMF file names it.
///
/// How fields are stored: 2 components are padded to 3, so that they are vectors to ParaView; 4 and 6 components are a
/// symmetric tensor in the order of base/types.h and become one dataset for each component, NAME_xx and so on; other
/// counts are kept. Every function is collective, and raises errors on all ranks alike.
class SeriesFile
{
public:
  /// @param comm  must outlive the object
  /// @param path  without suffix, or with .h5 or .xdmf; the folder must exist
  /// @param grid  name of the grid in the XDMF file
  /// @throws RunError if the files cannot be written, with path and reason
  SeriesFile(MPI_Comm comm, const std::filesystem::path& path, std::string grid, Storage storage);

  /// Starts the group of a frame.
  void begin_frame();

  /// Writes points of 2 or 3 coordinates, padded to 3, into the present group.
  XdmfData write_points(const RowSlice& rows, const OutputField& points);

  /// Numbers that all fit into 32 bits are stored so.
  XdmfData write_integers(const std::string& name, const RowSlice& rows, int width,
                          std::span<const std::int64_t> values);
  XdmfData write_integers(const std::string& name, const RowSlice& rows, int width,
                          std::span<const std::int32_t> values);

  /// Writes fields that live on nodes or cells into the present group.
  /// @return their description in XDMF
  std::string write_fields(const std::string& center, const RowSlice& rows, const std::vector<OutputField>& fields);
  std::string write_index_fields(const std::string& center, const RowSlice& rows,
                                 const std::vector<OutputIndexField>& fields);

  /// Puts a frame, whose datasets are written, into the XDMF file.
  void end_frame(double time, const std::string& content);

  /// Writes the XDMF file of a grid without time.
  void write_single(const std::string& content);

  /// Closes both files.
  void close();
  MPI_Comm comm() const { return _file.comm(); }

private:
  /// @param width  of the dataset; zeros come after the columns
  XdmfData write_reals(const std::string& name, const RowSlice& rows, std::span<const OutputColumn> columns, int width);
  /// Where a dataset of the present group is to be found, in XDMF.
  std::string address(const std::string& name) const;
  /// Lets the first rank do something with the XDMF file; what goes wrong is an error on all.
  template <class F>
  void with_xdmf(F&& work);

  Hdf5File _file;
  XdmfSeries _xdmf;
  Storage _storage;
  std::string _group; ///< group that datasets go into, without trailing slash
  int _n_frames = 0;
  int _n_groups = 0;                   ///< groups that are there for frames; those behind the last frame are empty
  std::vector<std::int32_t> _integers; ///< room for numbers that need no more
  std::vector<float> _single;          ///< room for a field in single precision
  std::vector<double> _double;         ///< the same in double precision
};

/// Particles over time. Their number may change, and ranks may have none.
class ParticleSeries
{
public:
  ParticleSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage);

  /// Writes a frame.
  /// @param time        s, finite
  /// @param position    of this rank's particles, 2 or 3 components; m
  /// @param fields      of as many rows each; the same names on all ranks
  /// @throws InputError if lengths do not match, names differ between ranks or are no plain words
  void write(double time, const OutputField& position, const std::vector<OutputField>& fields,
             const std::vector<OutputIndexField>& index_fields);

  MPI_Comm comm() const { return _series.comm(); }

  void close() { _series.close(); }

private:
  XdmfData write_vertices(const RowSlice& rows);

  SeriesFile _series;
  XdmfData _vertices; ///< the latest topology; written again only when the number of particles changes
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
  MeshSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage, int dimension,
             std::span<const double> points, std::span<const std::int64_t> cells);

  /// Writes a frame of fields on the nodes and cells given at the start.
  void write(double time, const std::vector<OutputField>& node_fields, const std::vector<OutputField>& cell_fields);

  void close() { _series.close(); }

private:
  SeriesFile _series;
  RowSlice _nodes;
  RowSlice _cells;
  std::string _grid; ///< XDMF of topology and geometry
};
} // namespace mpm
