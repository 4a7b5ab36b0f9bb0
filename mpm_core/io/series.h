#pragma once
/// @file
/// Particles and background mesh over time, in HDF5 files with an XDMF file beside them.

#include "io/frame_files.h"
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

using WholeNumbers = std::variant<std::span<const std::int64_t>, std::span<const std::int32_t>>;

/// Whole numbers to write, one per particle, node or cell.
struct OutputIndexField
{
  std::string name;
  WholeNumbers values;
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

/// The file PATH.xdmf of one series, and beside it the folder PATH with an HDF5 file for each frame, NUMBER.h5.
/// ParaView, VTK and meshio open the XDMF file, also while the run goes on and after it was killed: it names the files
/// that are whole.
///
/// How fields are stored: 2 components are padded to 3, so that they are vectors to ParaView; 4 and 6 components are a
/// symmetric tensor in the order of base/types.h and become one dataset for each component, NAME_xx and so on; other
/// counts are kept. Every function is collective, and raises errors on all ranks alike.
class SeriesFile
{
public:
  /// @param comm  must outlive the object
  /// @param path  without suffix, or with .h5 or .xdmf; the folder around it must exist. What an earlier series left
  ///              under this name is removed.
  /// @param grid  name of the grid in the XDMF file
  /// @throws RunError if the files cannot be written, with path and reason
  SeriesFile(MPI_Comm comm, const std::filesystem::path& path, std::string grid, Storage storage);

  /// Starts a frame. What is added to it must live until its end.
  void begin_frame(double time);

  /// Adds whole numbers; those that all fit into 32 bits are stored so.
  XdmfData add_integers(const std::string& name, const RowSlice& rows, int width, const WholeNumbers& values);

  /// Adds the grid: its cells, and points of 2 or 3 coordinates, padded to 3.
  XdmfData add_grid(const char* type, const XdmfData& cells, const RowSlice& rows, const OutputField& points);

  /// Adds a field that is the same data as something else.
  void add_field(const std::string& name, const char* center, const XdmfData& data);

  /// Adds fields that live on nodes or cells.
  void add_fields(const char* center, const RowSlice& rows, const std::vector<OutputField>& fields);
  void add_index_fields(const char* center, const RowSlice& rows, const std::vector<OutputIndexField>& fields);

  /// What the XDMF file says of the present file so far; it may be added to later ones.
  const std::string& description() const { return _description; }
  void add_description(const std::string& text) { _description += text; }

  /// Writes a frame, and names it in the XDMF file.
  void end_frame();

  /// Starts what a series without frames consists of, in a file of this name.
  void begin_single(const std::string& name) { begin(name + ".h5"); }
  void end_single();

  /// Closes the XDMF file.
  void close();
  MPI_Comm comm() const { return _files.comm(); }

private:
  /// A dataset of the present file, and where its values come from.
  struct Part
  {
    Dataset dataset;
    std::span<const OutputColumn> columns; ///< of real numbers; zeros come after them
    WholeNumbers whole;
  };
  void begin(const std::string& file);
  XdmfData add(Part part);
  XdmfData add_reals(const std::string& name, const RowSlice& rows, std::span<const OutputColumn> columns, int width);
  /// Writes the present file, and then has the first rank name it; if that fails, the file is removed.
  template <class F>
  void write_file(F&& then);
  /// Lets the first rank do something with files; what goes wrong is an error on all.
  template <class F>
  void on_first_rank(F&& work);

  FrameFiles _files;
  std::filesystem::path _folder;
  std::string _folder_name; ///< as the XDMF file beside it names it
  XdmfSeries _xdmf;
  Precision _precision;
  std::filesystem::path _path; ///< of the present file
  std::string _address;        ///< of its root, in XDMF
  std::vector<Part> _parts;
  std::string _description; ///< in XDMF
  int _n_frames = 0;
  bool _closed = false;
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
  /// @param failure     why this rank has no fields; empty if it has
  /// @throws InputError if a rank has none, lengths do not match, names differ between ranks or are no plain words
  void write(double time, const OutputField& position, const std::vector<OutputField>& fields,
             const std::vector<OutputIndexField>& index_fields, const std::string& failure = {});

  MPI_Comm comm() const { return _series.comm(); }

  void close() { _series.close(); }

private:
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
  /// @param fixed      fields on the cells that are the same in all frames
  MeshSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage, int dimension,
             std::span<const double> points, std::span<const std::int64_t> cells,
             const std::vector<OutputField>& fixed);

  /// Writes a frame of fields on the nodes and cells given at the start.
  /// @param failure  why this rank has no fields; empty if it has
  void write(double time, const std::vector<OutputField>& node_fields, const std::vector<OutputField>& cell_fields,
             const std::string& failure = {});

  MPI_Comm comm() const { return _series.comm(); }

  void close() { _series.close(); }

private:
  SeriesFile _series;
  RowSlice _nodes;
  RowSlice _cells;
  std::string _grid; ///< XDMF of topology, geometry and fixed fields
};
} // namespace mpm
