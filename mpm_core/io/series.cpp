#include "io/series.h"

#include <algorithm>
#include <cctype>
#include <cmath>

namespace mpm
{
namespace
{
const std::array<const char*, 6> component_names = {"xx", "yy", "zz", "xy", "yz", "xz"};

/// Groups for frames are made so many at a time; a frame itself changes its own group only.
constexpr int groups_ahead = 64;
/// Frames that are named without adding room to the list of their names.
constexpr unsigned frames_expected = 1600;

std::string frame_group(int frame) { return "/frames/" + std::to_string(frame); }

std::filesystem::path with_suffix(std::filesystem::path path, const char* suffix)
{
  if (path.extension() == ".h5" || path.extension() == ".xdmf")
    path.replace_extension();
  return path += suffix;
}

bool is_symmetric_tensor(std::size_t components) { return components == 4 || components == 6; }

/// Rows that are converted at once, so that what the components write stays in the cache.
constexpr std::size_t rows_at_once = 1024;

/// Puts columns side by side into rows, with zeros after them.
template <class T>
std::span<const T> copied_columns(std::span<const OutputColumn> columns, std::size_t n_rows, int width,
                                  std::vector<T>& rows)
{
  const auto w = static_cast<std::size_t>(width);
  if (columns.size() < w)
    rows.assign(n_rows * w, T(0));
  else
    rows.resize(n_rows * w);
  for (std::size_t begin = 0; begin < n_rows; begin += rows_at_once)
    for (std::size_t k = 0; k < columns.size(); ++k)
    {
      const auto [first, stride, minus] = columns[k];
      const std::size_t end = std::min(n_rows, begin + rows_at_once);
      T* to = rows.data() + k;
      if (minus)
        for (std::size_t row = begin; row < end; ++row)
          to[row * w] = static_cast<T>(first[row * stride] - minus[row * stride]);
      else if (w == 1 && stride == 1)
        std::transform(first + begin, first + end, to + begin, [](double v) { return static_cast<T>(v); });
      else
        for (std::size_t row = begin; row < end; ++row)
          to[row * w] = static_cast<T>(first[row * stride]);
    }
  return rows;
}

/// What is wrong with a field's name or length; empty if nothing is.
std::string field_error(const std::string& name, std::size_t components, std::size_t found, std::size_t expected)
{
  const auto plain = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-'; };
  if (name.empty() || !std::all_of(name.begin(), name.end(), plain))
    return "name of a field is '" + name + "', expected letters, digits, _ and -";
  if (components < 1)
    return name + " has " + std::to_string(components) + " components, expected at least 1";
  if (found != expected)
    return name + " has " + std::to_string(found) + " rows, expected " + std::to_string(expected);
  return {};
}

std::string fields_error(const std::vector<OutputField>& fields, const std::vector<OutputIndexField>& index_fields,
                         std::size_t n_rows)
{
  for (const OutputField& field : fields)
    if (std::string error = field_error(field.name, field.columns.size(), field.rows, n_rows); !error.empty())
      return error;
  for (const OutputIndexField& field : index_fields)
  {
    const std::size_t found = std::visit([](auto values) { return values.size(); }, field.values);
    if (std::string error = field_error(field.name, 1, found, n_rows); !error.empty())
      return error;
  }
  return {};
}

/// @note Collective
void require_frame(MPI_Comm comm, double time, std::string error, const std::vector<std::vector<OutputField>>& fields,
                   const std::vector<OutputIndexField>& index_fields)
{
  if (error.empty() && !std::isfinite(time))
    error = "time is " + std::to_string(time) + ", expected a finite number of seconds";
  error = shared_failure(comm, error);
  if (!error.empty())
    throw InputError(error);
  std::string names;
  for (const auto& list : fields)
    for (const OutputField& field : list)
      names += field.name + ":" + std::to_string(field.columns.size()) + ",";
  for (const OutputIndexField& field : index_fields)
    names += field.name + ",";
  if (!is_same_on_all_ranks(comm, names))
    throw InputError("fields are not the same on all ranks; here: " + names);
}
} // namespace

OutputField row_field(std::string name, std::span<const double> values, int components)
{
  const auto width = static_cast<std::size_t>(components);
  OutputField field{std::move(name), width == 0 ? 0 : values.size() / width, {}};
  for (std::size_t k = 0; k < width; ++k)
    field.columns.push_back({values.data() + k, width});
  return field;
}

SeriesFile::SeriesFile(MPI_Comm comm, const std::filesystem::path& path, std::string grid, Storage storage)
    : _file(comm, with_suffix(path, ".h5")), _xdmf(with_suffix(path, ".xdmf"), std::move(grid)), _storage(storage)
{
  _file.set_compression(storage.compression);
  with_xdmf([&] { return _xdmf.write_without_frames(); });
  _file.create_group("/frames", frames_expected);
}

void SeriesFile::begin_frame()
{
  if (_n_frames == _n_groups)
  {
    std::vector<std::string> names;
    names.reserve(groups_ahead);
    for (int k = 0; k < groups_ahead; ++k)
      names.push_back(frame_group(_n_groups++));
    _file.create_groups(names);
  }
  _group = frame_group(_n_frames);
  _file.enter_group(_group);
}

XdmfData SeriesFile::write_reals(const std::string& name, const RowSlice& rows, std::span<const OutputColumn> columns,
                                 int width)
{
  // HDF5 would convert by itself, but then each rank writes on its own instead of all together.
  const bool single = _storage.precision == Precision::float32;
  const auto n = static_cast<std::size_t>(rows.local);
  if (single)
    _file.write<float>(name, rows, width, copied_columns(columns, n, width, _single));
  else
    _file.write<double>(name, rows, width, copied_columns(columns, n, width, _double));
  return {address(name), rows.total, width, false, single ? 4 : 8};
}

XdmfData SeriesFile::write_integers(const std::string& name, const RowSlice& rows, int width,
                                    std::span<const std::int64_t> values)
{
  int small =
      std::all_of(values.begin(), values.end(), [](std::int64_t v) { return v == static_cast<std::int32_t>(v); });
  MPI_Allreduce(MPI_IN_PLACE, &small, 1, MPI_INT, MPI_MIN, comm());
  if (small)
  {
    _integers.assign(values.begin(), values.end());
    _file.write<std::int32_t>(name, rows, width, _integers);
  }
  else
    _file.write<std::int64_t>(name, rows, width, values);
  return {address(name), rows.total, width, true, small ? 4 : 8};
}

XdmfData SeriesFile::write_integers(const std::string& name, const RowSlice& rows, int width,
                                    std::span<const std::int32_t> values)
{
  _file.write<std::int32_t>(name, rows, width, values);
  return {address(name), rows.total, width, true, 4};
}

XdmfData SeriesFile::write_points(const RowSlice& rows, const OutputField& points)
{
  return write_reals(points.name, rows, points.columns, 3);
}

std::string SeriesFile::write_fields(const std::string& center, const RowSlice& rows,
                                     const std::vector<OutputField>& fields)
{
  std::string text;
  for (const OutputField& field : fields)
  {
    const std::span<const OutputColumn> columns = field.columns;
    const std::size_t n = columns.size();
    if (is_symmetric_tensor(n))
      for (std::size_t k = 0; k < n; ++k)
      {
        const std::string name = field.name + "_" + component_names[k];
        text += xdmf_attribute(name, center, write_reals(name, rows, columns.subspan(k, 1), 1));
      }
    else
    {
      const int width = n == 2 ? 3 : static_cast<int>(n);
      text += xdmf_attribute(field.name, center, write_reals(field.name, rows, columns, width));
    }
  }
  return text;
}

std::string SeriesFile::write_index_fields(const std::string& center, const RowSlice& rows,
                                           const std::vector<OutputIndexField>& fields)
{
  std::string text;
  for (const OutputIndexField& field : fields)
    text += std::visit([&](auto values)
                       { return xdmf_attribute(field.name, center, write_integers(field.name, rows, 1, values)); },
                       field.values);
  return text;
}

void SeriesFile::end_frame(double time, const std::string& content)
{
  _file.leave_group();
  _file.flush();
  _file.check();
  ++_n_frames;
  with_xdmf([&] { return _xdmf.append(xdmf_frame(time, content)); });
}

void SeriesFile::write_single(const std::string& content)
{
  _file.flush();
  _file.check();
  with_xdmf([&] { return _xdmf.write_single(content); });
}

void SeriesFile::close()
{
  for (; _n_groups > _n_frames; --_n_groups)
    _file.remove_group(frame_group(_n_groups - 1));
  _file.close();
  with_xdmf([&] { return _xdmf.finish(); });
}

std::string SeriesFile::address(const std::string& name) const
{
  return _file.path().filename().string() + ":" + _group + "/" + name;
}

template <class F>
void SeriesFile::with_xdmf(F&& work)
{
  int rank = 0;
  MPI_Comm_rank(comm(), &rank);
  const std::string failure = shared_failure(comm(), rank == 0 ? work() : std::string());
  if (!failure.empty())
    throw RunError(failure);
}

ParticleSeries::ParticleSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage)
    : _series(comm, path, "particles", storage)
{
}

void ParticleSeries::write(double time, const OutputField& position, const std::vector<OutputField>& fields,
                           const std::vector<OutputIndexField>& index_fields)
{
  require_frame(comm(), time, fields_error(fields, index_fields, position.rows), {fields}, index_fields);
  const RowSlice rows = row_slice(comm(), position.rows);
  _series.begin_frame();
  const XdmfData points = _series.write_points(rows, position);
  if (rows.total != _vertices.rows)
    _vertices = write_vertices(rows);
  // Named as a field as well: some readers give the points of the first frame only. It costs no space.
  const std::string content = xdmf_topology("Polyvertex", _vertices) + xdmf_geometry(points) +
                              xdmf_attribute("position", "Node", points) + _series.write_fields("Node", rows, fields) +
                              _series.write_index_fields("Node", rows, index_fields);
  _series.end_frame(time, content);
}

XdmfData ParticleSeries::write_vertices(const RowSlice& rows)
{
  std::vector<std::int64_t> numbers(static_cast<std::size_t>(rows.local));
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = rows.before + static_cast<std::int64_t>(i);
  return _series.write_integers("vertices", rows, 1, std::span<const std::int64_t>(numbers));
}

MeshSeries::MeshSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage, int dimension,
                       std::span<const double> points, std::span<const std::int64_t> cells)
    : _series(comm, path, "mesh", storage),
      _nodes(row_slice(comm, points.size() / static_cast<std::size_t>(dimension))),
      _cells(row_slice(comm, cells.size() / static_cast<std::size_t>(dimension + 1)))
{
  std::vector<std::int64_t> numbers(cells.begin(), cells.end());
  for (std::int64_t& node : numbers)
    node += _nodes.before;
  const XdmfData topology =
      _series.write_integers("cells", _cells, dimension + 1, std::span<const std::int64_t>(numbers));
  const XdmfData geometry = _series.write_points(_nodes, row_field("points", points, dimension));
  _grid = xdmf_topology(dimension == 2 ? "Triangle" : "Tetrahedron", topology) + xdmf_geometry(geometry);
  _series.write_single(_grid);
}

void MeshSeries::write(double time, const std::vector<OutputField>& node_fields,
                       const std::vector<OutputField>& cell_fields)
{
  std::string error = fields_error(node_fields, {}, static_cast<std::size_t>(_nodes.local));
  if (error.empty())
    error = fields_error(cell_fields, {}, static_cast<std::size_t>(_cells.local));
  require_frame(_series.comm(), time, error, {node_fields, cell_fields}, {});
  _series.begin_frame();
  const std::string content =
      _grid + _series.write_fields("Node", _nodes, node_fields) + _series.write_fields("Cell", _cells, cell_fields);
  _series.end_frame(time, content);
}
} // namespace mpm
