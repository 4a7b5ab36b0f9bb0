#include "io/frame_files.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace mpm::io
{
namespace
{
/// Files up to this length are put together in memory.
constexpr std::int64_t longest_image = 1 << 22;

bool are_alike(const std::vector<Dataset>& a, const std::vector<Dataset>& b)
{
  return std::ranges::equal(a, b,
                            [](const Dataset& one, const Dataset& other)
                            {
                              return one.name == other.name && one.rows.total == other.rows.total &&
                                     one.width == other.width && one.number == other.number;
                            });
}
} // namespace

FrameFiles::FrameFiles(MPI_Comm comm, int compression, int writer)
    : _comm(comm), _writer(writer), _compression(compression), _image(comm)
{
  MPI_Comm_rank(_comm, &_rank);
}

const std::vector<Dataset>& FrameFiles::begin(std::string path, std::vector<Dataset> datasets)
{
  const bool known = !_places.empty() && are_alike(datasets, _datasets);
  _path = std::move(path);
  _datasets = std::move(datasets);
  _next = 0;
  if (_compression > 0)
  {
    _compressed.emplace(_comm, _path, 0, _compression);
    return _datasets;
  }
  if (!known)
    make();
  if (_imaged)
    return _datasets;
  _file.emplace(_path.c_str(), O_WRONLY | O_CREAT); // whichever rank comes first makes it
  note(_file->number() >= 0);
  for (const Table& table : _tables)
    put(table.bytes.data(), table.bytes.size(), table.place);
  return _datasets;
}

void FrameFiles::make()
{
  _places.clear();
  Hdf5File file(_comm, _path);
  std::vector<std::int64_t> places = file.make(_datasets);
  file.close();
  _places = std::move(places);
  if (_rank == 0)
    read_tables();
  if (const std::string failure = shared_failure(_comm, _failure); !failure.empty())
    throw RunError(failure);
  MPI_Bcast(&_length, 1, MPI_INT64_T, 0, _comm);
  _imaged = can_image();
}

void FrameFiles::read_tables()
{
  std::vector<std::pair<std::int64_t, std::int64_t>> values; // bytes from and to
  for (std::size_t k = 0; k < _places.size(); ++k)
    if (_places[k] >= 0)
      values.emplace_back(_places[k], _places[k] + _datasets[k].rows.total * _datasets[k].row_bytes());
  const Descriptor file(_path.c_str(), O_RDONLY);
  _length = ::lseek(file.number(), 0, SEEK_END);
  note(_length >= 0);
  values.emplace_back(_length, _length);
  std::ranges::sort(values);
  _tables.clear();
  std::int64_t from = 0;
  for (const auto& [first, last] : values)
  {
    if (first > from)
    {
      Table table{from, std::string(static_cast<std::size_t>(first - from), '\0')};
      note(file.get(table.bytes.data(), table.bytes.size(), from));
      _tables.push_back(std::move(table));
    }
    from = last;
  }
}

bool FrameFiles::can_image()
{
  bool aligned = true;
  for (std::size_t k = 0; k < _places.size(); ++k)
    aligned = aligned && (_places[k] < 0 || _places[k] % bytes_of(_datasets[k].number) == 0);
  if (!aligned || _length < 0 || _length > longest_image || !_image.resize(static_cast<std::size_t>(_length)))
    return false;
  for (const Table& table : _tables)
    std::memcpy(_image.data() + table.place, table.bytes.data(), table.bytes.size());
  return true;
}

std::byte* FrameFiles::buffer()
{
  if (_next > 0)
    put_values();
  const Dataset& dataset = _datasets[_next++];
  if (_imaged)
    return _image.data() + std::max<std::int64_t>(0, _places[_next - 1]) + dataset.rows.before * dataset.row_bytes();
  _values.resize(std::max(_values.size(), dataset.local_bytes()));
  return _values.data();
}

void FrameFiles::put_values()
{
  const Dataset& dataset = _datasets[_next - 1];
  if (_compressed)
    _compressed->write(dataset, _values.data());
  else if (!_imaged)
    put(_values.data(), dataset.local_bytes(), _places[_next - 1] + dataset.rows.before * dataset.row_bytes());
}

void FrameFiles::put(const void* bytes, std::size_t count, std::int64_t place)
{
  if (count > 0 && _file->number() >= 0) // else it is known already
    note(_file->put(bytes, count, place));
}

void FrameFiles::note(bool succeeded)
{
  if (!succeeded && _failure.empty())
    _failure = "cannot write " + _path + ": " + std::strerror(errno);
}

void FrameFiles::complete()
{
  if (_next > 0)
    put_values();
  if (_compressed)
  {
    _compressed->close();
    _compressed.reset();
  }
  else if (_imaged)
    _image.synchronise();
  else
  {
    _file.reset();
    _failure = shared_failure(_comm, _failure);
  }
}

std::string FrameFiles::write()
{
  if (_imaged && is_writer())
  {
    _file.emplace(_path.c_str(), O_WRONLY | O_CREAT);
    note(_file->number() >= 0);
    put(_image.data(), static_cast<std::size_t>(_length), 0);
    _file.reset();
  }
  return std::exchange(_failure, {});
}

void FrameFiles::forget()
{
  _places.clear();
  _failure.clear();
  _file.reset();
  _compressed.reset();
}
} // namespace mpm::io
