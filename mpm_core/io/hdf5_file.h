#pragma once
/// @file
/// An HDF5 file that all ranks write together.

#include "io/descriptor.h"
#include "parallel/agreement.h"
#include "parallel/row_slice.h"

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace mpm::io
{
/// How numbers are stored.
enum class Number
{
  float32,
  float64,
  int32,
  int64
};

template <class T>
inline constexpr Number number_of = std::is_same_v<T, float>          ? Number::float32
                                    : std::is_same_v<T, double>       ? Number::float64
                                    : std::is_same_v<T, std::int32_t> ? Number::int32
                                                                      : Number::int64;

inline std::int64_t bytes_of(Number number) { return number == Number::float32 || number == Number::int32 ? 4 : 8; }

/// An array that all ranks write, each its rows.
struct Dataset
{
  std::string name; ///< from the root
  RowSlice rows;
  int width = 1; ///< values per row; the dataset has the shape (rows.total, width), or (rows.total,) if this is 1
  Number number = Number::float64;

  std::int64_t row_bytes() const { return width * bytes_of(number); }
  std::size_t local_bytes() const { return static_cast<std::size_t>(rows.local * row_bytes()); }
};

/// An HDF5 file that all ranks of a communicator write together.
///
/// The first rank makes groups and datasets by HDF5; then all ranks put their values, by the system's own calls, where
/// HDF5 says that they belong. HDF5 over MPI, which makes all ranks wait for each other several times per dataset and
/// for the disk at the end, takes several times as long. Only values to be compressed must pass through HDF5; then all
/// ranks open the file by MPI.
///
/// A rank on which something fails goes on through the same collective calls as the others, so that nobody waits for
/// it; `check` then raises the same RunError on all ranks. Every function is collective.
class Hdf5File
{
public:
  /// Creates the file; an older one under that name is replaced.
  /// @param comm         must outlive the file
  /// @param user_block   bytes at the file's start that HDF5 leaves free: 0, or a power of two from 512 on
  /// @param compression  level of deflate, 1 to 9; 0 stores values as they are
  /// @throws RunError on all ranks, with path and reason
  Hdf5File(MPI_Comm comm, std::filesystem::path path, int user_block = 0, int compression = 0);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  void create_group(const std::string& name);

  /// Makes datasets without values, not to be compressed.
  /// @return bytes of the file where their values begin; -1 for those that have none, and if something fails
  std::vector<std::int64_t> make(std::span<const Dataset> datasets);

  /// Makes a dataset with its values.
  /// @param values  this rank's, (rows.local, width) row-major
  void write(const Dataset& dataset, const void* values);

  template <class T>
  void write(const std::string& name, const RowSlice& rows, int width, std::span<const T> values)
  {
    write({name, rows, width, number_of<T>}, values.data());
  }

  /// Writes a text as an attribute of the root.
  void write_text(const std::string& name, const std::string& text);

  /// @throws RunError on all ranks if anything failed on any rank since the file was opened, with path and reason
  void check();

  /// @throws RunError as `check` does
  void close();

  MPI_Comm comm() const { return _comm; }

private:
  void write_compressed(const Dataset& dataset, const void* values);
  /// Takes note of what HDF5's last call could not do.
  void note(bool succeeded, const char* doing);
  /// Takes note of what the system refused.
  void note_obstacle(const std::string& reason);
  /// Reserves space for more bytes; a failure is noted, and they must not be written.
  bool reserve(std::int64_t bytes);

  MPI_Comm _comm;
  int _rank = 0;
  std::filesystem::path _path;
  int _compression;
  std::int64_t _file = -1; ///< hid_t, which is not named here so that only sources of this folder see HDF5; -1 on ranks
                           ///< that do not open the file
  bool _by_mpi = false;    ///< all ranks open the file
  std::optional<Descriptor> _values; ///< by which this rank's values go into the file
  std::string _failure;              ///< what failed first on this rank; empty if nothing did
  std::int64_t _needed = 0;          ///< bytes that the file may have come to need
};
} // namespace mpm::io
