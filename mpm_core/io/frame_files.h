#pragma once
/// @file
/// Many HDF5 files that differ in their values only.

#include "io/hdf5_file.h"

namespace mpm
{
/// Writes one HDF5 file after another.
///
/// HDF5 makes a file whose datasets differ from those of the file before. Its tables are kept, and a file with the same
/// datasets is these tables with other values, without HDF5, whose work on a dozen datasets takes longer than writing
/// the values of several thousand particles. Compressed files are all made by HDF5.
///
/// Every function is collective.
class FrameFiles
{
public:
  /// @param comm  must outlive the object
  FrameFiles(MPI_Comm comm, int compression) : _comm(comm), _compression(compression) {}

  /// Starts a file; there must be none under that name.
  /// @throws RunError as `end` does
  void begin(const std::filesystem::path& path, std::vector<Dataset> datasets);

  /// Room for this rank's values of the next dataset, in the order given to `begin`, (rows.local, width) row-major; to
  /// be filled in before the next call.
  template <class T>
  std::span<T> next()
  {
    return {reinterpret_cast<T*>(room()), _datasets[_next - 1].local_bytes() / sizeof(T)};
  }

  /// Finishes the file, which is on disk when this returns.
  /// @throws RunError on all ranks, with path and reason; the file is of no use then
  void end();

  MPI_Comm comm() const { return _comm; }

private:
  /// Tables between values, or before or after them.
  struct Piece
  {
    std::int64_t place;
    std::string bytes;
  };
  std::byte* room();
  /// Room for bytes that belong to a place in the file; they wait until what comes next belongs elsewhere.
  std::byte* room_at(std::int64_t place, std::size_t bytes, std::size_t alignment);
  /// Reads what HDF5 wrote into the present file.
  void read_tables();
  /// Takes note of what the system's last call could not do.
  void note(bool succeeded);
  /// Writes the values that are waiting.
  void put_waiting();
  /// Writes the values of the latest dataset.
  void write_compressed();

  MPI_Comm _comm;
  int _compression;
  std::filesystem::path _path;
  std::vector<Dataset> _datasets;    ///< of the present file, and of the tables
  std::vector<std::int64_t> _places; ///< bytes of the file where their values begin; -1 for those without
  std::vector<Piece> _tables;        ///< on the first rank
  std::size_t _next = 0;             ///< dataset to be given values next
  std::optional<Hdf5File> _compressed;
  std::optional<Descriptor> _file;
  std::vector<std::byte> _waiting; ///< values to be written together
  std::size_t _n_waiting = 0;      ///< bytes
  std::int64_t _waiting_place = 0; ///< where they belong
  std::string _failure;
};
} // namespace mpm
