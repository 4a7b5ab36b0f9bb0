#include "io/hdf5_file.h"

#include "io/hdf5_calls.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
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
/// The same for a group alone.
constexpr std::int64_t group_size = 1024;
/// The same for a name in a group.
constexpr std::int64_t link_size = 48;
/// Room that is always kept for tables that HDF5 has not written yet, in bytes.
constexpr std::int64_t table_room = 1 << 18;

/// More names than this, or than were expected, in a group go into tables of their own.
constexpr unsigned most_names_inside = 64;
/// Length of names for which a group has room from the start; adding room later takes time.
constexpr unsigned name_length = 16;
/// Names in the group of a frame.
constexpr unsigned names_in_frame = 16;

/// What is reserved at once beyond what is needed: a quarter of it, between these, in bytes. Each call costs some time.
constexpr std::int64_t least_ahead = 1 << 22, most_ahead = 1 << 26;

/// Reserves space on the disk for bytes [first, last) of a file, which is created if it is not there and becomes as
/// long. A disk that fills up while HDF5 writes leaves a file that HDF5 cannot even close; asked beforehand, all that
/// was written stays. And readers, who note the length of a file first, never find it shorter than HDF5 says it must
/// be. File systems that cannot reserve are taken at their word.
/// @return why it cannot be had; empty if it can
std::string reservation_obstacle(const std::filesystem::path& path, std::int64_t first, std::int64_t last)
{
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (file < 0)
    return std::strerror(errno);
  int error = 0;
#ifdef __linux__
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && static_cast<rlim_t>(last) > limit.rlim_cur)
    error = EFBIG;
  else if (::fallocate(file, 0, first, last - first) != 0 && errno != EOPNOTSUPP)
    error = errno;
#endif
  ::close(file);
  return error == 0 ? "" : std::strerror(error);
}

/// Lets HDF5 write changed tables between flushes, to make room in memory, or not.
void allow_early_writing(std::int64_t file, bool allowed)
{
  H5AC_cache_config_t cache{};
  cache.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  H5Fget_mdc_config(file, &cache);
  cache.evictions_enabled = allowed;
  H5Fset_mdc_config(file, &cache);
}

/// Bytes that the disk keeps for a file, its size or more.
std::int64_t kept_bytes(const std::filesystem::path& path)
{
  struct stat status
  {
  };
  return ::stat(path.c_str(), &status) == 0 ? 512 * static_cast<std::int64_t>(status.st_blocks) : 0;
}

/// How the file is accessed. Its tables are kept in memory up to a fixed size: HDF5 goes through all of them at each
/// flush, which would come to cost more than the values in a long run.
hid_t access_properties(MPI_Comm comm, bool parallel)
{
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  if (parallel) // alone, a rank writes four times as fast without MPI in between
    H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL);
  H5Pset_file_locking(access, false, true); // others may read while the run goes on
  H5Pset_sieve_buf_size(access, 1);         // whole arrays are written, so nothing is to be gathered
  H5AC_cache_config_t cache{};
  cache.version = H5AC__CURR_CACHE_CONFIG_VERSION;
  H5Pget_mdc_config(access, &cache);
  cache.set_initial_size = true;
  cache.initial_size = cache.min_size = cache.max_size = 1 << 16;
  cache.incr_mode = H5C_incr__off;
  cache.flash_incr_mode = H5C_flash_incr__off;
  cache.decr_mode = H5C_decr__off;
  H5Pset_mdc_config(access, &cache);
  return access;
}

/// How groups are made. With their order kept, names can be stored in the group itself instead of in tables beside it:
/// that is quick, and readers, who read it as a whole, meet no table that has changed since they read another.
hid_t group_properties(unsigned expected_names)
{
  const hid_t creation = H5Pcreate(H5P_GROUP_CREATE);
  H5Pset_link_creation_order(creation, H5P_CRT_ORDER_TRACKED);
  H5Pset_link_phase_change(creation, std::max(most_names_inside, expected_names), 0);
  H5Pset_est_link_info(creation, expected_names, name_length);
  return creation;
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
  if (!is_same_on_all_ranks(_comm, _path))
  {
    _failure = "path is not the same on all ranks; here: " + _path.string();
    check();
  }
  if (!has_room(table_size))
    check();
  const Quiet quiet;
  int size = 1;
  MPI_Comm_size(_comm, &size);
  _parallel = size > 1;
  const hid_t access = access_properties(_comm, _parallel);
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
  leave_all_groups();
  H5Fclose(_file);
}

void Hdf5File::note(bool succeeded, const char* doing)
{
  if (!succeeded && _failure.empty())
    _failure = std::string("cannot ") + doing + " " + _path.string() + ": " + hdf5_reason();
}

bool Hdf5File::has_room(std::int64_t bytes)
{
  _needed += bytes;
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

void Hdf5File::create_group(const std::string& name, unsigned expected_names)
{
  if (_file < 0)
    throw RunError("cannot write " + _path.string() + ": it is closed");
  const Quiet quiet;
  if (!has_room(group_size + link_size * expected_names))
    return;
  const hid_t creation = group_properties(expected_names);
  const hid_t group = H5Gcreate2(_file, name.c_str(), H5P_DEFAULT, creation, H5P_DEFAULT);
  note(group >= 0, "write");
  H5Pclose(creation);
  if (group >= 0)
    H5Gclose(group);
}

void Hdf5File::create_groups(const std::vector<std::string>& names)
{
  if (_file < 0)
    throw RunError("cannot write " + _path.string() + ": it is closed");
  const Quiet quiet;
  if (!has_room(group_size * static_cast<std::int64_t>(names.size())))
    return;
  const hid_t creation = group_properties(names_in_frame);
  std::vector<hid_t> groups;
  for (std::size_t k = 0; k < names.size(); ++k)
    groups.push_back(H5Gcreate_anon(_file, creation, H5P_DEFAULT));
  H5Pclose(creation);
  flush();
  allow_early_writing(_file, false);
  for (std::size_t k = 0; k < names.size(); ++k)
  {
    note(H5Olink(groups[k], _file, names[k].c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0, "write");
    _ahead[names[k]] = groups[k];
  }
  flush();
  allow_early_writing(_file, true);
}

void Hdf5File::remove_group(const std::string& name)
{
  const Quiet quiet;
  if (const auto group = _ahead.extract(name))
    H5Gclose(group.mapped());
  note(H5Ldelete(_file, name.c_str(), H5P_DEFAULT) >= 0, "write");
}

void Hdf5File::enter_group(const std::string& name)
{
  const Quiet quiet;
  leave_group();
  if (const auto group = _ahead.extract(name))
    _group = group.mapped();
  note(_group >= 0, "write");
}

void Hdf5File::leave_group()
{
  if (_group >= 0)
    H5Gclose(std::exchange(_group, -1));
}

void Hdf5File::leave_all_groups()
{
  leave_group();
  for (const auto& [name, group] : _ahead)
    H5Gclose(group);
  _ahead.clear();
}

template <class T>
void Hdf5File::write(const std::string& name, const RowSlice& rows, int width, std::span<const T> values)
{
  const Quiet quiet;
  if (!has_room(table_size + rows.total * width * static_cast<std::int64_t>(sizeof(T))))
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
  const bool compressed = _compression > 0 && rows.total > 0;
  const hid_t creation = compressed ? H5Pcreate(H5P_DATASET_CREATE) : H5P_DEFAULT;
  if (compressed)
  {
    // Deflate works on chunks; of this size HDF5's own tables stay small.
    const hsize_t chunk[2] = {std::min<hsize_t>(shape[0], 1 << 16), columns};
    H5Pset_chunk(creation, rank, chunk);
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, static_cast<unsigned>(_compression));
  }
  const hid_t dataset = H5Dcreate2(_group >= 0 ? _group : _file, name.c_str(), native_type<T>(), in_file, H5P_DEFAULT,
                                   creation, H5P_DEFAULT);
  if (compressed)
    H5Pclose(creation);
  note(dataset >= 0, "write");
  const hid_t transfer = _parallel ? H5Pcreate(H5P_DATASET_XFER) : H5P_DEFAULT;
  if (_parallel)
    H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE);
  if (dataset >= 0 && rows.total > 0)
    note(H5Dwrite(dataset, native_type<T>(), in_memory, in_file, transfer, values.data()) >= 0, "write");
  if (dataset >= 0)
    H5Dclose(dataset);
  if (_parallel)
    H5Pclose(transfer);
  H5Sclose(in_memory);
  H5Sclose(in_file);
}

void Hdf5File::write_text(const std::string& name, const std::string& text)
{
  const Quiet quiet;
  if (!has_room(table_size + static_cast<std::int64_t>(text.size())))
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
  // Where the file was cut to its size, as MPI does, what was reserved beyond is gone.
  if (_parallel || kept_bytes(_path) < _reserved)
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
  const Quiet quiet;
  leave_all_groups();
  flush();
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  hsize_t length = 0;
  if (rank == 0 && H5Fget_filesize(_file, &length) >= 0)
  {
    std::error_code of_no_consequence;
    std::filesystem::resize_file(_path, length, of_no_consequence); // gives back what was reserved
  }
  note(H5Fclose(std::exchange(_file, -1)) >= 0, "close");
  check();
}

template void Hdf5File::write<float>(const std::string&, const RowSlice&, int, std::span<const float>);
template void Hdf5File::write<double>(const std::string&, const RowSlice&, int, std::span<const double>);
template void Hdf5File::write<std::int32_t>(const std::string&, const RowSlice&, int, std::span<const std::int32_t>);
template void Hdf5File::write<std::int64_t>(const std::string&, const RowSlice&, int, std::span<const std::int64_t>);
} // namespace mpm
