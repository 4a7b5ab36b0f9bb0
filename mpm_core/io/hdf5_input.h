#pragma once
/// @file
/// A parallel HDF5 file that all ranks read together.

#include "io/hdf5_file.h"

namespace mpm
{
/// An HDF5 file opened by all ranks for reading. As with `Hdf5File`, a rank on which something fails goes on through
/// the same calls as the others, with values of zero, and `check` raises the error on all. Every function is
/// collective.
class Hdf5Input
{
public:
  /// @param comm  must outlive the object
  /// @throws RunError on all ranks, with path and reason
  Hdf5Input(MPI_Comm comm, std::filesystem::path path);
  ~Hdf5Input();
  Hdf5Input(const Hdf5Input&) = delete;
  Hdf5Input& operator=(const Hdf5Input&) = delete;

  bool has(const std::string& name) const;

  /// Rows of an array, and values per row.
  std::pair<GlobalIndex, int> shape(const std::string& name);

  /// This rank's rows of an array.
  /// @param rows   which rows; `total` is not used
  /// @param width  values per row that the array must have
  /// @return (rows.local, width) row-major; T is double or std::int64_t
  template <class T>
  std::vector<T> read(const std::string& name, const RowSlice& rows, int width);

  /// A text that `Hdf5File::write_text` wrote.
  std::string read_text(const std::string& name);

  /// @throws RunError on all ranks if anything failed on any, with path and reason
  void check();

private:
  void note(bool succeeded, const std::string& doing);

  MPI_Comm _comm;
  std::filesystem::path _path;
  std::int64_t _file = -1; ///< hid_t
  std::string _failure;
};
} // namespace mpm
