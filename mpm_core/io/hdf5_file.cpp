#include "io/hdf5_file.h"

#include "io/hdf5_calls.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace mpm
{
namespace
{
/// What HDF5's own tables take at most for one dataset and its group, in bytes (measured: some 2000).
constexpr std::int64_t table_size = 4096;
/// Room that is always kept for tables that HDF5 has not written yet, in bytes.
constexpr std::int64_t table_room = 1 << 18;

/// What is reserved at once beyond what is needed: a quarter of it, between these, in bytes. Each call costs some time.
constexpr std::int64_t least_ahead = 1 << 20, most_ahead = 1 << 26;

/// Reserves space on the disk for bytes [first, last) of a file, which is created if it is not there; its size stays. A
/// disk that fills up while HDF5 writes leaves a file that HDF5 cannot even close; asked beforehand, all that was
/// written stays. File systems that cannot reserve are taken at their word.
/// @return why it cannot be had; empty if it can
std::string reservation_obstacle(const std::filesystem::path& path, std::int64_t first, std::int64_t last)
{
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0)
    return std::strerror(errno);
  int error = 0;
#ifdef __linux__
  // Room beyond the end of a file does not count as its size yet.
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && static_cast<rlim_t>(last) > limit.rlim_cur)
    error = EFBIG;
  else if (::fallocate(file, FALLOC_FL_KEEP_SIZE, first, last - first) != 0 && errno != EOPNOTSUPP)
    error = errno;
#endif
  ::close(file);
  return error == 0 ? "" : std::strerror(error);
}

/// Gives back what was reserved beyond the end of a file.
void release_rest(const std::filesystem::path& path)
{
  std::error_code error;
  if (const auto size = std::filesystem::file_size(path, error); !error)
    std::filesystem::resize_file(path, size, error); // of no consequence where it fails
}
} // namespace

RowSlice row_slice(MPI_Comm comm, std::size_t local)
{
  RowSlice rows;
  rows.local = static_cast<GlobalIndex>(local);
  GlobalIndex up_to_here = 0;
  MPI_Scan(&rows.local, &up_to_here, 1, MPI_INT64_T, MPI_SUM, comm);
  rows.before = up_to_here - rows.local;
  MPI_Allreduce(&rows.local, &rows.total, 1, MPI_INT64_T, MPI_SUM, comm);
  return rows;
}

Hdf5File::Hdf5File(MPI_Comm comm, std::filesystem::path path, int user_block) : _comm(comm), _path(std::move(path))
{
  if (!has_room(0))
    check();
  const Quiet quiet;
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  int size = 1;
  MPI_Comm_size(_comm, &size);
  _parallel = size > 1;
  if (_parallel) // alone, a rank writes four times as fast without MPI in between
    H5Pset_fapl_mpio(access, _comm, MPI_INFO_NULL);
  H5Pset_file_locking(access, false, true); // others may read while the run goes on
  const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
  H5Pset_userblock(creation, static_cast<hsize_t>(user_block));
  _file = H5Fcreate(_path.c_str(), H5F_ACC_TRUNC, creation, access);
  note(_file >= 0, "create");
  _reserved = 0; // what an older file had, HDF5 has given back
  H5Pclose(creation);
  H5Pclose(access);
  check();
}

Hdf5File::~Hdf5File()
{
  int finalized = 0;
  MPI_Finalized(&finalized);
  if (finalized || _file < 0)
    return;
  const Quiet quiet;
  H5Fclose(_file);
}

void Hdf5File::note(bool succeeded, const char* doing)
{
  if (!succeeded && _failure.empty())
    _failure = std::string("cannot ") + doing + " " + _path.string() + ": " + hdf5_reason();
}

bool Hdf5File::has_room(std::int64_t bytes)
{
  _needed += bytes + table_size;
  const std::int64_t needed = _needed + table_room;
  if (needed <= _reserved)
    return true;
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  std::string obstacle;
  if (rank == 0)
  {
    const std::int64_t ahead = needed + std::clamp(needed / 4, least_ahead, most_ahead);
    const std::int64_t first = std::exchange(_reserved, ahead);
    if (!reservation_obstacle(_path, first, ahead).empty())
    {
      _reserved = needed;
      obstacle = reservation_obstacle(_path, first, needed);
    }
  }
  MPI_Bcast(&_reserved, 1, MPI_INT64_T, 0, _comm);
  obstacle = shared_failure(_comm, obstacle);
  if (!obstacle.empty() && _failure.empty())
    _failure = "cannot write " + _path.string() + ": " + obstacle;
  return obstacle.empty();
}

void Hdf5File::create_group(const std::string& name)
{
  if (_file < 0)
    throw RunError("cannot write " + _path.string() + ": it is closed");
  const Quiet quiet;
  const hid_t group = H5Gcreate2(_file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  note(group >= 0, "write");
  if (group >= 0)
    H5Gclose(group);
}

template <class T>
void Hdf5File::write(const std::string& name, const RowSlice& rows, int width, std::span<const T> values)
{
  const Quiet quiet;
  if (!has_room(rows.total * width * static_cast<std::int64_t>(sizeof(T))))
    return;
  const int rank = width == 1 ? 1 : 2;
  const hsize_t columns = static_cast<hsize_t>(width);
  const hsize_t shape[2] = {static_cast<hsize_t>(rows.total), columns};
  const hsize_t start[2] = {static_cast<hsize_t>(rows.before), 0};
  const hsize_t count[2] = {static_cast<hsize_t>(rows.local), columns};
  const hid_t in_file = H5Screate_simple(rank, shape, nullptr);
  const hid_t in_memory = H5Screate_simple(rank, count, nullptr);
  if (rows.local > 0)
    H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start, nullptr, count, nullptr);
  else
    H5Sselect_none(in_file);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  if (_compression > 0 && rows.total > 0)
  {
    // Deflate works on chunks; of this size HDF5's own tables stay small.
    const hsize_t chunk[2] = {std::min<hsize_t>(shape[0], 1 << 16), columns};
    H5Pset_chunk(creation, rank, chunk);
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, static_cast<unsigned>(_compression));
  }
  const hid_t dataset = H5Dcreate2(_file, name.c_str(), native_type<T>(), in_file, H5P_DEFAULT, creation, H5P_DEFAULT);
  H5Pclose(creation);
  note(dataset >= 0, "write");
  const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
  if (_parallel)
    H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE);
  if (dataset >= 0 && rows.total > 0)
    note(H5Dwrite(dataset, native_type<T>(), in_memory, in_file, transfer, values.data()) >= 0, "write");
  if (dataset >= 0)
    H5Dclose(dataset);
  H5Pclose(transfer);
  H5Sclose(in_memory);
  H5Sclose(in_file);
}

void Hdf5File::write_text(const std::string& name, const std::string& text)
{
  const Quiet quiet;
  if (!has_room(static_cast<std::int64_t>(text.size())))
    return;
  const hid_t type = H5Tcopy(H5T_C_S1);
  H5Tset_size(type, text.size() + 1);
  H5Tset_cset(type, H5T_CSET_UTF8);
  const hid_t space = H5Screate(H5S_SCALAR);
  const hid_t attribute = H5Acreate2(_file, name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT);
  note(attribute >= 0 && H5Awrite(attribute, type, text.c_str()) >= 0, "write");
  if (attribute >= 0)
    H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
}

void Hdf5File::flush()
{
  const Quiet quiet;
  note(H5Fflush(_file, H5F_SCOPE_GLOBAL) >= 0, "write");
  _reserved = 0;
}

void Hdf5File::check()
{
  if (const std::string failure = shared_failure(_comm, _failure); !failure.empty())
    throw RunError(failure);
}

void Hdf5File::close()
{
  if (_file < 0)
    return;
  {
    const Quiet quiet;
    note(H5Fclose(_file) >= 0, "close");
  }
  _file = -1;
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  if (rank == 0)
    release_rest(_path);
  check();
}

template void Hdf5File::write<float>(const std::string&, const RowSlice&, int, std::span<const float>);
template void Hdf5File::write<double>(const std::string&, const RowSlice&, int, std::span<const double>);
template void Hdf5File::write<std::int32_t>(const std::string&, const RowSlice&, int, std::span<const std::int32_t>);
template void Hdf5File::write<std::int64_t>(const std::string&, const RowSlice&, int, std::span<const std::int64_t>);
} // namespace mpm
