#pragma once
/// @file
/// An HDF5 file that all ranks read together. What it says of itself is not believed: a file may come from anywhere.

#include "io/hdf5_file.h"

namespace mpm::io
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
  /// @return (rows.local, width) row-major, T is double or std::int64_t; after a failure of any length
  template <class T>
  std::vector<T> read(const std::string& name, const RowSlice& rows, int width);

  /// A text that `Hdf5File::write_text` wrote.
  std::string read_text(const std::string& name);

  /// Takes note of content that cannot be; `check` raises the first of such notes.
  void reject(const std::string& name, const std::string& reason);

  /// @throws RunError on all ranks if anything failed on any, with path and reason
  void check();

private:
  /// Bytes that the values of an array take in the file, and no more than the file has.
  std::int64_t stored_bytes(const std::string& name);
  void note(bool succeeded, const std::string& doing);

  MPI_Comm _comm;
  std::filesystem::path _path;
  std::int64_t _file = -1; ///< hid_t
  std::string _failure;
};
} // namespace mpm::io
