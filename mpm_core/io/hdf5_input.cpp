#include "io/hdf5_input.h"

#include "io/hdf5_calls.h"

namespace mpm
{
Hdf5Input::Hdf5Input(MPI_Comm comm, std::filesystem::path path) : _comm(comm), _path(std::move(path))
{
  const Quiet quiet;
  const hid_t access = H5Pcreate(H5P_FILE_ACCESS);
  H5Pset_fapl_mpio(access, _comm, MPI_INFO_NULL);
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

template <class T>
std::vector<T> Hdf5Input::read(const std::string& name, const RowSlice& rows, int width)
{
  const Quiet quiet;
  std::vector<T> values(static_cast<std::size_t>(rows.local * width));
  const auto [total, columns] = shape(name);
  if (columns != width || rows.before + rows.local > total)
  {
    if (_failure.empty())
      _failure = "cannot read " + name + " in " + _path.string() + ": it has " + std::to_string(total) + " rows of " +
                 std::to_string(columns) + ", expected " + std::to_string(width) + " numbers in a row";
    return values;
  }
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
  const hid_t transfer = H5Pcreate(H5P_DATASET_XFER);
  H5Pset_dxpl_mpio(transfer, H5FD_MPIO_COLLECTIVE);
  note(H5Dread(dataset, hdf5_type(number_of<T>), in_memory, in_file, transfer, values.data()) >= 0, "read " + name);
  H5Pclose(transfer);
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
  const hid_t type = H5Aget_type(attribute);
  std::string text(H5Tget_size(type), '\0');
  note(H5Aread(attribute, type, text.data()) >= 0, "read " + name);
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
} // namespace mpm
