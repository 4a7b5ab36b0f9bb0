#include "io/frame_files.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

namespace mpm
{
namespace
{
/// Values are gathered for one write up to about so many bytes, so that they are still in the cache when it comes.
constexpr std::size_t most_waiting = 1 << 20;

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

void FrameFiles::begin(const std::filesystem::path& path, std::vector<Dataset> datasets)
{
  int rank = 0;
  MPI_Comm_rank(_comm, &rank);
  const bool known = !_places.empty() && are_alike(datasets, _datasets);
  _path = path;
  _datasets = std::move(datasets);
  _next = 0;
  if (_compression > 0)
  {
    _compressed.emplace(_comm, _path, 0, _compression);
    return;
  }
  if (!known)
  {
    _places.clear();
    Hdf5File file(_comm, _path);
    std::vector<std::int64_t> places = file.make(_datasets);
    file.close();
    _places = std::move(places);
    if (rank == 0)
      read_tables();
  }
  _file.emplace(_path, O_WRONLY | O_CREAT); // whichever rank comes first makes it
  note(_file->number() >= 0);
  if (known)
    for (const Piece& piece : _tables)
      std::memcpy(room_at(piece.place, piece.bytes.size(), 1), piece.bytes.data(), piece.bytes.size());
}

void FrameFiles::note(bool succeeded)
{
  if (!succeeded && _failure.empty())
    _failure = "cannot write " + _path.string() + ": " + std::strerror(errno);
}

void FrameFiles::read_tables()
{
  std::vector<std::pair<std::int64_t, std::int64_t>> values; // bytes from and to
  for (std::size_t k = 0; k < _places.size(); ++k)
    if (_places[k] >= 0)
      values.emplace_back(_places[k], _places[k] + _datasets[k].rows.total * _datasets[k].row_bytes());
  const Descriptor file(_path, O_RDONLY);
  const std::int64_t length = ::lseek(file.number(), 0, SEEK_END);
  values.emplace_back(length, length);
  std::ranges::sort(values);
  _tables.clear();
  std::int64_t from = 0;
  for (const auto& [first, last] : values)
  {
    if (first > from)
    {
      Piece piece{from, std::string(static_cast<std::size_t>(first - from), '\0')};
      note(file.get(piece.bytes.data(), piece.bytes.size(), from));
      _tables.push_back(std::move(piece));
    }
    from = last;
  }
}

std::byte* FrameFiles::room()
{
  if (_compressed && _next > 0)
    write_compressed();
  const Dataset& dataset = _datasets[_next];
  const std::int64_t place = _compressed ? 0 : _places[_next] + dataset.rows.before * dataset.row_bytes();
  ++_next;
  return room_at(place, dataset.local_bytes(), static_cast<std::size_t>(bytes_of(dataset.number)));
}

std::byte* FrameFiles::room_at(std::int64_t place, std::size_t bytes, std::size_t alignment)
{
  const bool follows = place == _waiting_place + static_cast<std::int64_t>(_n_waiting);
  if (_n_waiting > 0 && (!follows || _n_waiting > most_waiting || _n_waiting % alignment != 0))
    put_waiting();
  if (_n_waiting == 0)
    _waiting_place = place;
  const std::size_t first = std::exchange(_n_waiting, _n_waiting + bytes);
  if (_waiting.size() < _n_waiting)
    _waiting.resize(_n_waiting);
  return _waiting.data() + first;
}

void FrameFiles::write_compressed()
{
  _compressed->write(_datasets[_next - 1], _waiting.data());
  _n_waiting = 0;
}

void FrameFiles::put_waiting()
{
  if (_file->number() >= 0) // else it is known already
    note(_file->put(_waiting.data(), _n_waiting, _waiting_place));
  _n_waiting = 0;
}

void FrameFiles::end()
{
  if (_compressed)
  {
    if (_next > 0)
      write_compressed();
    _compressed->close();
    _compressed.reset();
    return;
  }
  put_waiting();
  _file.reset();
  const std::string failure = shared_failure(_comm, std::exchange(_failure, {}));
  if (failure.empty())
    return;
  _places.clear(); // nothing is to be built on a file that may have been read in part
  throw RunError(failure);
}
} // namespace mpm
