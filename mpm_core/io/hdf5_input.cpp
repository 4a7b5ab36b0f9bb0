#include "io/hdf5_input.h"

#include "io/hdf5_calls.h"

#include <algorithm>

namespace mpm::io
{
Hdf5Input::Hdf5Input(MPI_Comm comm, std::filesystem::path path) : _comm(comm), _path(std::move(path))
{
  const Quiet quiet;
  // Each rank by itself: MPI's own files cannot be read under a path of more than some 240 characters (Open MPI 4).
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_file_locking(access, false, true); // file systems of clusters may not have locks
  _file = H5Fopen(_path.c_str(), H5F_ACC_RDONLY, access);
  note(_file >= 0, "open");
  H5Pclose(access);
  check();
}

Hdf5Input::~Hdf5Input()
{
  const Quiet quiet;
  if (_file >= 0)
    H5Fclose(_file);
}

void Hdf5Input::note(bool succeeded, const std::string& doing)
{
  if (!succeeded && _failure.empty())
    _failure = "cannot " + doing + " in " + _path.string() + ": " + hdf5_reason();
}

bool Hdf5Input::has(const std::string& name) const
{
  const Quiet quiet;
  return H5Lexists(_file, name.c_str(), H5P_DEFAULT) > 0;
}

std::pair<GlobalIndex, int> Hdf5Input::shape(const std::string& name)
{
  const Quiet quiet;
  hsize_t lengths[2] = {0, 1};
  const hid_t dataset = H5Dopen2(_file, name.c_str(), H5P_DEFAULT);
  note(dataset >= 0, "read " + name);
  if (dataset < 0)
    return {0, 1};
  const hid_t space = H5Dget_space(dataset);
  const int rank = H5Sget_simple_extent_ndims(space);
  if (rank == 1 || rank == 2)
    H5Sget_simple_extent_dims(space, lengths, nullptr);
  H5Sclose(space);
  H5Dclose(dataset);
  return {static_cast<GlobalIndex>(lengths[0]), static_cast<int>(lengths[1])};
}

void Hdf5Input::reject(const std::string& name, const std::string& reason)
{
  if (_failure.empty())
    _failure = "cannot read " + name + " in " + _path.string() + ": " + reason;
}

std::int64_t Hdf5Input::stored_bytes(const std::string& name)
{
  const Quiet quiet;
  const hid_t dataset = H5Dopen2(_file, name.c_str(), H5P_DEFAULT);
  const auto stored = dataset >= 0 ? H5Dget_storage_size(dataset) : 0;
  if (dataset >= 0)
    H5Dclose(dataset);
  std::error_code unknown;
  const auto length = std::filesystem::file_size(_path, unknown);
  return static_cast<std::int64_t>(unknown ? 0 : std::min<std::uintmax_t>(stored, length));
}

template <class T>
std::vector<T> Hdf5Input::read(const std::string& name, const RowSlice& rows, int width)
{
  const Quiet quiet;
  const auto [total, columns] = shape(name);
  const std::int64_t stored = stored_bytes(name) / (width * static_cast<std::int64_t>(sizeof(T)));
  if (columns != width || rows.local < 0 || rows.before < 0 || rows.before + rows.local > total || total > stored)
  {
    reject(name, "it has " + std::to_string(total) + " rows of " + std::to_string(columns) + " in " +
                     std::to_string(stored_bytes(name)) + " bytes, expected at least " +
                     std::to_string(rows.before + rows.local) + " rows of " + std::to_string(width));
    // Never more than the file can hold, whatever it says of itself.
    return std::vector<T>(rows.local > 0 && rows.local <= stored ? static_cast<std::size_t>(rows.local * width) : 0);
  }
  std::vector<T> values(static_cast<std::size_t>(rows.local * width));
  if (total == 0)
    return values;
  const hid_t dataset = H5Dopen2(_file, name.c_str(), H5P_DEFAULT);
  const hid_t in_file = H5Dget_space(dataset);
  const hsize_t start[2] = {static_cast<hsize_t>(rows.before), 0};
  const hsize_t count[2] = {static_cast<hsize_t>(rows.local), static_cast<hsize_t>(width)};
  const hid_t in_memory = H5Screate_simple(width == 1 ? 1 : 2, count, nullptr);
  if (rows.local > 0)
    H5Sselect_hyperslab(in_file, H5S_SELECT_SET, start, nullptr, count, nullptr);
  else
    H5Sselect_none(in_file);
  note(H5Dread(dataset, hdf5_type(number_of<T>), in_memory, in_file, H5P_DEFAULT, values.data()) >= 0, "read " + name);
  H5Sclose(in_memory);
  H5Sclose(in_file);
  H5Dclose(dataset);
  return values;
}

std::string Hdf5Input::read_text(const std::string& name)
{
  const Quiet quiet;
  const hid_t attribute = H5Aopen(_file, name.c_str(), H5P_DEFAULT);
  note(attribute >= 0, "read " + name);
  if (attribute < 0)
    return {};
  const hid_t type = H5Aget_type(attribute), space = H5Aget_space(attribute);
  std::error_code unknown;
  std::string text;
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 || H5Sget_simple_extent_npoints(space) != 1 ||
      H5Tget_size(type) > std::filesystem::file_size(_path, unknown))
    reject(name, "it is no text of a length that the file can hold");
  else
  {
    text.resize(H5Tget_size(type));
    note(H5Aread(attribute, type, text.data()) >= 0, "read " + name);
  }
  H5Sclose(space);
  H5Tclose(type);
  H5Aclose(attribute);
  return text.substr(0, text.find('\0'));
}

void Hdf5Input::check()
{
  if (const std::string failure = shared_failure(_comm, _failure); !failure.empty())
    throw RunError(failure);
}

template std::vector<double> Hdf5Input::read(const std::string&, const RowSlice&, int);
template std::vector<std::int64_t> Hdf5Input::read(const std::string&, const RowSlice&, int);
} // namespace mpm::io
