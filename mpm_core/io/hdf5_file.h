#pragma once
/// @file
/// A parallel HDF5 file that all ranks write together.

#include "parallel/agreement.h"

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace mpm
{
/// This rank's rows in an array that all ranks hold together, by rising rank.
struct RowSlice
{
  GlobalIndex before = 0; ///< rows on lower ranks
  GlobalIndex local = 0;
  GlobalIndex total = 0;
};

/// @note Collective
RowSlice row_slice(MPI_Comm comm, std::size_t local);

/// An HDF5 file opened by all ranks of a communicator for writing.
///
/// A rank on which something fails goes on through the same collective calls as the others, so that nobody waits for
/// it; `check` then raises the same RunError on all ranks. Every function is collective.
class Hdf5File
{
public:
  /// Creates the file; an older one under that name is replaced.
  /// @param comm        must outlive the file
  /// @param user_block  bytes at the file's start that HDF5 leaves free: 0, or a power of two from 512 on
  /// @throws RunError on all ranks, with path and reason
  Hdf5File(MPI_Comm comm, std::filesystem::path path, int user_block = 0);
  ~Hdf5File();
  Hdf5File(const Hdf5File&) = delete;
  Hdf5File& operator=(const Hdf5File&) = delete;

  /// Arrays that are written from now on are compressed by deflate, level 1 to 9; 0 stores them as they are.
  void set_compression(int level) { _compression = level; }

  /// @param expected_names  for which the group has room from the start
  void create_group(const std::string& name, unsigned expected_names = 16);

  /// Makes empty groups at once. The list of names in a file is what a kill while it is written spoils for all that is
  /// named in it, so it is better written seldom than often; the groups are in the file before it names them.
  void create_groups(const std::vector<std::string>& names);

  /// Takes a group away, with all that is in it.
  void remove_group(const std::string& name);

  /// Lets the datasets written from now on go into a group that `create_groups` made, until `leave_group`.
  /// @pre it was not entered before
  void enter_group(const std::string& name);
  void leave_group();

  /// Writes a whole array, each rank its rows.
  /// @param name    of the dataset, from the root, or in the group that was entered
  /// @param rows    this rank's share, from `row_slice`
  /// @param width   values per row; the dataset has the shape (rows.total, width), or (rows.total,) if the width is 1
  /// @param values  (rows.local, width) row-major; T is float, double, std::int32_t or std::int64_t
  template <class T>
  void write(const std::string& name, const RowSlice& rows, int width, std::span<const T> values);

  /// Writes a text as an attribute of the root.
  void write_text(const std::string& name, const std::string& text);

  /// Makes all that was written so far readable by others, now and if the run is killed.
  void flush();

  /// @throws RunError on all ranks if anything failed on any rank since the file was opened, with path and reason
  void check();

  /// @throws RunError as `check` does
  void close();

  MPI_Comm comm() const { return _comm; }
  const std::filesystem::path& path() const { return _path; }

private:
  void leave_all_groups();
  void note(bool succeeded, const char* doing);
  /// Reserves room for more values; if it cannot be had, that is noted and they must not be written.
  bool has_room(std::int64_t bytes);

  MPI_Comm _comm;
  std::filesystem::path _path;
  std::int64_t _file = -1;  ///< hid_t, which is not named here so that only sources of this folder see HDF5
  std::int64_t _group = -1; ///< hid_t of the group that was entered
  std::map<std::string, std::int64_t> _ahead; ///< those of groups that were made and not yet entered
  std::string _failure;                       ///< what failed first on this rank; empty if nothing did
  int _compression = 0;
  bool _parallel = false;     ///< several ranks write by MPI; one by itself does without
  std::int64_t _needed = 0;   ///< bytes that the file may have come to need
  std::int64_t _reserved = 0; ///< bytes that are certain to be had
};
} // namespace mpm
