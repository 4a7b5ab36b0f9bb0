#pragma once
/// @file
/// Many HDF5 files that differ in their values only.

#include "io/hdf5_file.h"
#include "parallel/shared_memory.h"

#include <algorithm>

namespace mpm::io
{
/// Writes one HDF5 file after another.
///
/// HDF5 makes a file whose datasets differ from those of the file before. Its tables are kept, and a file with the same
/// datasets is these tables with other values, without HDF5, whose work on a dozen datasets takes longer than writing
/// the values of several thousand particles. Compressed files are all made by HDF5.
///
/// Ranks of one machine put a small file together in memory, and one of them writes it: the system lets one rank at a
/// time write into a file, and many small writes by turns take twice as long. Into other files each rank writes its own
/// values.
///
/// Functions are collective unless they say otherwise.
class FrameFiles
{
public:
  /// @param comm    must outlive the object
  /// @param writer  the rank that writes files which ranks put together
  FrameFiles(MPI_Comm comm, int compression, int writer);

  /// Starts a file; there must be none under that name.
  /// @return the datasets
  /// @throws RunError on all ranks, with path and reason; the file is of no use then
  const std::vector<Dataset>& begin(std::string path, std::vector<Dataset> datasets);

  /// Room for this rank's values of the next dataset, in the order given to `begin`, (rows.local, width) row-major; to
  /// be filled in before the next call.
  template <class T>
  std::span<T> next()
  {
    return {reinterpret_cast<T*>(buffer()), _datasets[_next - 1].local_bytes() / sizeof(T)};
  }

  /// Memory for all ranks' values of the dataset that `next` opened, (rows.total, width) row-major, where ranks
  /// put the file together in memory; else empty. Each row is to be filled in by one rank, whichever has it.
  template <class T>
  std::span<T> whole() const
  {
    const Dataset& dataset = _datasets[_next - 1];
    if (!_imaged)
      return {};
    return {reinterpret_cast<T*>(_image.data() + std::max<std::int64_t>(0, _places[_next - 1])),
            static_cast<std::size_t>(dataset.rows.total * dataset.width)};
  }

  /// Waits until all ranks have given all values; then the file is written, or it is there for the writer to write.
  /// @throws RunError as `begin` does, if the file is compressed
  void complete();

  /// Writes the file, where that is still to be done; it is on disk when this returns on the writer. Not collective.
  /// @return what went wrong; empty if nothing did
  std::string write();

  /// Is to be called after a failure: what the present file consists of must not be built on.
  void forget();

  /// Gives memory back; nothing can be written after that.
  void close() { _image.free(); }

  MPI_Comm comm() const { return _comm; }
  bool is_writer() const { return _rank == _writer; }

private:
  /// Tables between values, or before or after them.
  struct Table
  {
    std::int64_t place;
    std::string bytes;
  };
  /// Has HDF5 make the file, and keeps its tables.
  void make();
  /// Reads what HDF5 wrote into the present file.
  void read_tables();
  /// Whether the file can be put together in memory; if so, the tables are there.
  bool can_image();
  std::byte* buffer();
  /// Writes the values of the latest dataset.
  void put_values();
  void put(const void* bytes, std::size_t count, std::int64_t place);
  /// Takes note of what the system's last call could not do.
  void note(bool succeeded);

  MPI_Comm _comm;
  int _rank = 0;
  int _writer;
  int _compression;
  std::string _path;
  std::vector<Dataset> _datasets;    ///< of the present file, and of the tables
  std::vector<std::int64_t> _places; ///< bytes of the file where their values begin; -1 for those without
  std::int64_t _length = 0;          ///< of the file, in bytes
  std::vector<Table> _tables;        ///< on the first rank
  std::size_t _next = 0;             ///< dataset to be given values next
  std::optional<Hdf5File> _compressed;
  std::optional<Descriptor> _file;
  SharedMemory _image;            ///< the file
  bool _imaged = false;           ///< this file is put together there
  std::vector<std::byte> _values; ///< else, of the latest dataset
  std::string _failure;
};
} // namespace mpm::io
