#include "io/hdf5_file.h"

#include "io/hdf5_calls.h"

#include <sys/resource.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace mpm::io
{
namespace
{
/// What HDF5's own tables take at most for one dataset or group, in bytes (measured: some 2000).
constexpr std::int64_t table_size = 4096;
/// HDF5 sets aside so many bytes at once for tables, so that they lie together, before the values.
constexpr std::int64_t table_block = 1 << 13;
/// Open MPI 4 aborts a little above 240 characters: it puts the path, and more, into a buffer of 256.
constexpr std::size_t longest_mpi_path = 200;

/// Reserves space on the disk for the first bytes of a file, which is created if it is not there. A disk that fills up
/// while HDF5 writes leaves a file that HDF5 cannot even close. File systems that cannot reserve are taken at their
/// word.
/// @return why it cannot be had; empty if it can
std::string reservation_obstacle(const std::filesystem::path& path, std::int64_t bytes)
{
  const Descriptor file(path.c_str(), O_WRONLY | O_CREAT);
  if (file.number() < 0)
    return std::strerror(errno);
#ifdef __linux__
  rlimit limit{};
  if (::getrlimit(RLIMIT_FSIZE, &limit) == 0 && static_cast<rlim_t>(bytes) > limit.rlim_cur)
    return std::strerror(EFBIG);
  if (::fallocate(file.number(), 0, 0, bytes) != 0 && errno != EOPNOTSUPP)
    return std::strerror(errno);
#endif
  return {};
}

hid_t access_properties(MPI_Comm comm, bool by_mpi)
{
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  if (by_mpi)
    H5Pset_fapl_mpio(access, comm, MPI_INFO_NULL);
  H5Pset_file_locking(access, false, true); // file systems of clusters may not have locks
  H5Pset_meta_block_size(access, table_block);
  return access;
}

hid_t space_of(const Dataset& dataset)
{
  const hsize_t shape[2] = {static_cast<hsize_t>(dataset.rows.total), static_cast<hsize_t>(dataset.width)};
  return H5Screate_simple(dataset.width == 1 ? 1 : 2, shape, nullptr);
}
} // namespace

Hdf5File::Hdf5File(MPI_Comm comm, std::filesystem::path path, int user_block, int compression)
    : _comm(comm), _path(std::move(path)), _compression(compression)
{
  MPI_Comm_rank(_comm, &_rank);
  int size = 1;
  MPI_Comm_size(_comm, &size);
  _by_mpi = _compression > 0 && size > 1;
  if (!is_same_on_all_ranks(_comm, _path))
    _failure = "path is not the same on all ranks; here: " + _path.string();
  if (_by_mpi && _path.string().size() > longest_mpi_path)
    note_obstacle("several ranks can compress only under a path of at most " + std::to_string(longest_mpi_path) +
                  " characters; it has " + std::to_string(_path.string().size()));
  check();
  const Quiet quiet;
  if ((_rank == 0 || _by_mpi) && reserve(table_block))
  {
    const hid_t access = access_properties(_comm, _by_mpi);
    const hid_t creation = H5Pcreate(H5P_FILE_CREATE);
    H5Pset_userblock(creation, static_cast<hsize_t>(user_block));
    _file = H5Fcreate(_path.c_str(), H5F_ACC_TRUNC, creation, access);
    note(_file >= 0, "create");
    H5Pclose(creation);
    H5Pclose(access);
  }
  check();
  if (_compression > 0)
    return;
  _values.emplace(_path.c_str(), O_WRONLY);
  if (_values->number() < 0)
    note_obstacle(std::strerror(errno));
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

void Hdf5File::note_obstacle(const std::string& reason)
{
  if (_failure.empty())
    _failure = "cannot write " + _path.string() + ": " + reason;
}

bool Hdf5File::reserve(std::int64_t bytes)
{
  _needed += bytes;
  std::string obstacle = _rank == 0 ? reservation_obstacle(_path, _needed) : "";
  if (_by_mpi)
    obstacle = shared_failure(_comm, obstacle);
  if (!obstacle.empty())
    note_obstacle(obstacle);
  return obstacle.empty();
}

void Hdf5File::create_group(const std::string& name)
{
  const Quiet quiet;
  if (_file < 0 || !reserve(table_size))
    return;
  const hid_t group = H5Gcreate2(_file, name.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  note(group >= 0, "write");
  if (group >= 0)
    H5Gclose(group);
}

std::vector<std::int64_t> Hdf5File::make(std::span<const Dataset> datasets)
{
  const Quiet quiet;
  std::vector<std::int64_t> places(datasets.size(), -1);
  std::int64_t bytes = 0;
  for (const Dataset& dataset : datasets)
    bytes += table_size + dataset.rows.total * dataset.row_bytes();
  if (_rank == 0 && reserve(bytes))
  {
    const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); // or the place would not be known yet
    H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER);
    H5Pset_obj_track_times(creation, false); // the same content makes the same file
    for (std::size_t k = 0; k < datasets.size(); ++k)
    {
      const hid_t space = space_of(datasets[k]);
      const hid_t dataset = H5Dcreate2(_file, datasets[k].name.c_str(), hdf5_type(datasets[k].number), space,
                                       H5P_DEFAULT, creation, H5P_DEFAULT);
      note(dataset >= 0, "write");
      if (dataset >= 0 && datasets[k].rows.total > 0)
      {
        places[k] = static_cast<std::int64_t>(H5Dget_offset(dataset));
        note(places[k] >= 0, "write");
      }
      if (dataset >= 0)
        H5Dclose(dataset);
      H5Sclose(space);
    }
    H5Pclose(creation);
  }
  MPI_Bcast(places.data(), static_cast<int>(places.size()), MPI_INT64_T, 0, _comm);
  return places;
}

void Hdf5File::write(const Dataset& dataset, const void* values)
{
  if (_compression > 0)
    return write_compressed(dataset, values);
  const std::int64_t place = make({&dataset, 1})[0];
  if (place >= 0 && !_values->put(values, dataset.local_bytes(), place + dataset.rows.before * dataset.row_bytes()))
    note_obstacle(std::strerror(errno));
}

void Hdf5File::write_compressed(const Dataset& dataset, const void* values)
{
  const RowSlice& rows = dataset.rows;
  const Quiet quiet;
  if (_file < 0 || !reserve(table_size + rows.total * dataset.row_bytes()))
    return;
  const int rank = dataset.width == 1 ? 1 : 2;
  const hsize_t columns = static_cast<hsize_t>(dataset.width);
  const hsize_t start[2] = {static_cast<hsize_t>(rows.before), 0};
  const hsize_t count[2] = {static_cast<hsize_t>(rows.local), columns};
  const hid_t in_file = space_of(dataset);
  const hid_t in_memory = H5Screate_simple(rank, count, nullptr);
  if (rows.local > 0)
    H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start, nullptr, count, nullptr);
  else
    H5Sselect_none(in_file);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  if (rows.total > 0)
  {
    // Deflate works on chunks; of this size HDF5's own tables stay small.
    const hsize_t chunk[2] = {std::min<hsize_t>(static_cast<hsize_t>(rows.total), 1 << 16), columns};
    H5Pset_chunk(creation, rank, chunk);
    H5Pset_shuffle(creation);
    H5Pset_deflate(creation, static_cast<unsigned>(_compression));
  }
  const hid_t type = hdf5_type(dataset.number);
  const hid_t made = H5Dcreate2(_file, dataset.name.c_str(), type, in_file, H5P_DEFAULT, creation, H5P_DEFAULT);
  H5Pclose(creation);
  note(made >= 0, "write");
  const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
  if (_by_mpi)
    H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE);
  if (made >= 0 && rows.total > 0)
    note(H5Dwrite(made, type, in_memory, in_file, transfer, values) >= 0, "write");
  if (made >= 0)
    H5Dclose(made);
  H5Pclose(transfer);
  H5Sclose(in_memory);
  H5Sclose(in_file);
}

void Hdf5File::write_text(const std::string& name, const std::string& text)
{
  const Quiet quiet;
  if (_file < 0 || !reserve(table_size + static_cast<std::int64_t>(text.size())))
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

void Hdf5File::check()
{
  if (const std::string failure = shared_failure(_comm, _failure); !failure.empty())
    throw RunError(failure);
}

void Hdf5File::close()
{
  _values.reset();
  if (_file >= 0)
  {
    const Quiet quiet;
    note(H5Fflush(_file, H5F_SCOPE_GLOBAL) >= 0, "write");
    hsize_t length = 0;
    if (_rank == 0 && H5Fget_filesize(_file, &length) >= 0)
    {
      std::error_code of_no_consequence;
      std::filesystem::resize_file(_path, length, of_no_consequence); // gives back what was reserved
    }
    note(H5Fclose(std::exchange(_file, -1)) >= 0, "close");
  }
  check();
}
} // namespace mpm::io
