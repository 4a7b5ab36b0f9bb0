#pragma once
/// @file
/// One series of frames over time, in HDF5 files with an XDMF file beside them.

#include "io/frame_files.h"
#include "io/xdmf.h"
#include "parallel/row_carrier.h"

#include <variant>
#include <vector>

namespace mpm::io
{
/// One component of real values to write, where they are: every `stride`-th number from `first` on.
struct OutputColumn
{
  const double* first;
  std::size_t stride = 1;
  const double* minus = nullptr; ///< what is taken away from each, with the same stride; nothing if null

  double operator[](std::size_t row) const { return first[row * stride] - (minus ? minus[row * stride] : 0.0); }
};

/// Real values to write, one row per particle, node or cell.
struct OutputField
{
  std::string name;
  std::size_t rows;
  std::vector<OutputColumn> columns; ///< one per component
  const char* out_of_plane = "zz";   ///< name of the third of four components
  RowCarrier* carrier = nullptr; ///< brings the rows from ranks whose columns have them; null: they are in order here
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
  /// @param comm    must outlive the object
  /// @param path    without suffix, or with .h5 or .xdmf; the folder around it must exist. What an earlier series left
  ///                under this name is removed.
  /// @param grid    name of the grid in the XDMF file
  /// @param writer  the rank that writes the XDMF file, and files that ranks put together
  /// @throws RunError if the files cannot be written, with path and reason
  SeriesFile(MPI_Comm comm, const std::filesystem::path& path, std::string grid, Storage storage, int writer);

  /// Starts a frame. What is added to it must live until its end.
  void begin_frame(double time);

  /// Adds whole numbers.
  XdmfData add_integers(const std::string& name, const RowSlice& rows, int width, Number number,
                        const WholeNumbers& values);

  /// Adds the grid: its cells, and points of 2 or 3 coordinates, padded to 3.
  XdmfData add_grid(const char* type, const XdmfData& cells, const RowSlice& rows, const OutputField& points);

  /// Adds a field that is the same data as something else.
  void add_field(const std::string& name, const char* center, const XdmfData& data);

  /// Adds fields of real numbers.
  void add_fields(const char* center, const RowSlice& rows, const std::vector<OutputField>& fields);

  /// What the XDMF file says of the present file so far, as the writer knows; it may be added to later ones.
  const std::string& description() const { return _description; }
  void add_description(const std::string& text);

  /// Starts what a series without frames consists of, in a file of this name.
  void begin_single(const std::string& name);

  /// Writes what was begun in several series, and names it in their XDMF files. The series share their ranks; those
  /// with different writers are written at the same time.
  /// @throws RunError if one of them cannot be written, with path and reason; its file is removed
  static void write(const std::vector<SeriesFile*>& series);

  /// Closes the XDMF file.
  void close();

  int n_frames() const { return _n_frames; } ///< that were written
  MPI_Comm comm() const { return _files.comm(); }

private:
  /// Where the values of a dataset of the present file come from.
  struct Source
  {
    std::span<const OutputColumn> columns; ///< of real numbers; zeros come after them
    RowCarrier* carrier = nullptr;
    WholeNumbers whole = {};
  };
  void begin(const std::string& file);
  /// Gives values to the present file.
  void fill();
  /// Writes the present file, and then names it, where this rank is to do so. Not collective.
  /// @return what went wrong; empty if nothing did
  std::string finish();
  /// Removes the present file.
  void discard();
  XdmfData add(Dataset dataset, Source source);
  XdmfData add_reals(const std::string& name, const RowSlice& rows, std::span<const OutputColumn> columns, int width,
                     RowCarrier* carrier = nullptr);
  template <class T>
  void copy_reals(const Dataset& dataset, const Source& source);
  /// Lets the writer do something with files; what goes wrong is an error on all.
  template <class F>
  void on_writer(F&& work);

  FrameFiles _files;
  std::filesystem::path _folder;
  std::string _folder_name; ///< as the XDMF file beside it names it
  XdmfSeries _xdmf;
  Precision _precision;
  std::string _path;    ///< of the present file
  std::string _address; ///< of its root, in XDMF
  std::vector<Dataset> _datasets;
  std::vector<Source> _sources;
  std::string _description; ///< in XDMF
  bool _single = false;     ///< the present file is no frame
  int _n_frames = 0;
  bool _closed = false;
};
} // namespace mpm::io
