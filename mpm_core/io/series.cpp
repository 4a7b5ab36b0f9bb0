#include "io/series.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>
#include <utility>

namespace mpm
{
namespace
{
const std::array<const char*, 6> component_names = {"xx", "yy", "zz", "xy", "yz", "xz"};

constexpr std::size_t digits_of_frames = 6;

/// Name of a frame's file.
std::string frame_file(int frame)
{
  const std::string number = std::to_string(frame);
  return std::string(digits_of_frames - std::min(digits_of_frames, number.size()), '0') + number + ".h5";
}

bool is_frame_file(const std::filesystem::path& path)
{
  const std::string stem = path.stem().string();
  return path.extension() == ".h5" && stem.size() >= digits_of_frames &&
         std::ranges::all_of(stem, [](unsigned char c) { return std::isdigit(c) != 0; });
}

/// Makes the folder of a series, or removes the frames of an earlier one from it.
/// @return what went wrong; empty if nothing did
std::string prepared_folder(const std::filesystem::path& folder)
{
  std::error_code error;
  std::filesystem::create_directory(folder, error);
  const std::filesystem::directory_iterator end;
  for (std::filesystem::directory_iterator entry(folder, error); !error && entry != end; entry.increment(error))
    if (is_frame_file(entry->path()))
      std::filesystem::remove(entry->path(), error);
  return error ? "cannot write " + folder.string() + ": " + error.message() : "";
}

std::filesystem::path without_suffix(std::filesystem::path path)
{
  return path.extension() == ".h5" || path.extension() == ".xdmf" ? path.replace_extension() : path;
}

bool is_symmetric_tensor(std::size_t components) { return components == 4 || components == 6; }

/// Rows that are converted at once, so that what the components write stays in the cache.
constexpr std::size_t rows_at_once = 1024;

/// Puts columns side by side into rows of a width, with zeros after them.
template <class T>
void copy_columns(std::span<const OutputColumn> columns, int width, std::span<T> rows)
{
  const auto w = static_cast<std::size_t>(width);
  const std::size_t n_rows = rows.size() / w;
  for (std::size_t begin = 0; begin < n_rows; begin += rows_at_once)
  {
    const std::size_t end = std::min(n_rows, begin + rows_at_once);
    for (std::size_t k = 0; k < columns.size(); ++k)
    {
      const auto [first, stride, minus] = columns[k];
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
    for (std::size_t k = columns.size(); k < w; ++k)
      for (std::size_t row = begin; row < end; ++row)
        rows[row * w + k] = T(0);
  }
}

template <class T>
void copy_numbers(const WholeNumbers& numbers, std::span<T> to)
{
  std::visit([&](auto values) { std::ranges::transform(values, to.begin(), [](auto v) { return static_cast<T>(v); }); },
             numbers);
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
void require_frame(MPI_Comm comm, double time, std::string error,
                   std::initializer_list<const std::vector<OutputField>*> fields,
                   const std::vector<OutputIndexField>& index_fields)
{
  if (error.empty() && !std::isfinite(time))
    error = "time is " + std::to_string(time) + ", expected a finite number of seconds";
  std::string names;
  for (const auto* list : fields)
    for (const OutputField& field : *list)
      names += field.name + ":" + std::to_string(field.columns.size()) + ",";
  for (const OutputIndexField& field : index_fields)
    names += field.name + ",";
  const auto [failure, same] = agreement(comm, error, names);
  if (!failure.empty())
    throw InputError(failure);
  if (!same)
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
    : _files(comm, storage.compression), _folder(without_suffix(path)), _folder_name(_folder.filename()),
      _xdmf(_folder.string() + ".xdmf", std::move(grid)), _precision(storage.precision)
{
  if (!is_same_on_all_ranks(comm, _folder))
    throw RunError("path is not the same on all ranks; here: " + _folder.string());
  on_first_rank([&] { return prepared_folder(_folder); });
  on_first_rank([&] { return _xdmf.write_without_frames(); });
}

void SeriesFile::begin(const std::string& file)
{
  if (_closed)
    throw RunError("cannot write " + _folder.string() + ": it is closed");
  _path = _folder / file;
  _address = _folder_name + "/" + file + ":/";
  _parts.clear();
  _description.clear();
}

void SeriesFile::begin_frame(double time)
{
  begin(frame_file(_n_frames));
  _description = begin_of_frame(time);
}

XdmfData SeriesFile::add(Part part)
{
  const Dataset& dataset = part.dataset;
  const bool integer = dataset.number == Number::int32 || dataset.number == Number::int64;
  XdmfData data{_address + dataset.name, dataset.rows.total, dataset.width, integer,
                static_cast<int>(bytes_of(dataset.number))};
  _parts.push_back(std::move(part));
  return data;
}

XdmfData SeriesFile::add_reals(const std::string& name, const RowSlice& rows, std::span<const OutputColumn> columns,
                               int width)
{
  const Number number = _precision == Precision::float32 ? Number::float32 : Number::float64;
  return add({{name, rows, width, number}, columns, {}});
}

XdmfData SeriesFile::add_integers(const std::string& name, const RowSlice& rows, int width, const WholeNumbers& values)
{
  int small = 1;
  if (const auto* wide = std::get_if<std::span<const std::int64_t>>(&values))
  {
    small = std::ranges::all_of(*wide, [](std::int64_t v) { return v == static_cast<std::int32_t>(v); });
    MPI_Allreduce(MPI_IN_PLACE, &small, 1, MPI_INT, MPI_MIN, comm());
  }
  return add({{name, rows, width, small ? Number::int32 : Number::int64}, {}, values});
}

XdmfData SeriesFile::add_grid(const char* type, const XdmfData& cells, const RowSlice& rows, const OutputField& points)
{
  XdmfData geometry = add_reals(points.name, rows, points.columns, 3);
  add_topology(_description, type, cells);
  add_geometry(_description, geometry);
  return geometry;
}

void SeriesFile::add_field(const std::string& name, const char* center, const XdmfData& data)
{
  add_attribute(_description, name, center, data);
}

void SeriesFile::add_fields(const char* center, const RowSlice& rows, const std::vector<OutputField>& fields)
{
  for (const OutputField& field : fields)
  {
    const std::span<const OutputColumn> columns = field.columns;
    const std::size_t n = columns.size();
    if (is_symmetric_tensor(n))
      for (std::size_t k = 0; k < n; ++k)
      {
        const std::string name = field.name + "_" + component_names[k];
        add_field(name, center, add_reals(name, rows, columns.subspan(k, 1), 1));
      }
    else
      add_field(field.name, center, add_reals(field.name, rows, columns, n == 2 ? 3 : static_cast<int>(n)));
  }
}

void SeriesFile::add_index_fields(const char* center, const RowSlice& rows, const std::vector<OutputIndexField>& fields)
{
  for (const OutputIndexField& field : fields)
    add_field(field.name, center, add_integers(field.name, rows, 1, field.values));
}

template <class F>
void SeriesFile::write_file(F&& then)
{
  try
  {
    std::vector<Dataset> datasets;
    for (const Part& part : _parts)
      datasets.push_back(part.dataset);
    _files.begin(_path, std::move(datasets));
    for (const Part& part : _parts)
      switch (part.dataset.number)
      {
      case Number::float32:
        copy_columns(part.columns, part.dataset.width, _files.next<float>());
        break;
      case Number::float64:
        copy_columns(part.columns, part.dataset.width, _files.next<double>());
        break;
      case Number::int32:
        copy_numbers(part.whole, _files.next<std::int32_t>());
        break;
      case Number::int64:
        copy_numbers(part.whole, _files.next<std::int64_t>());
        break;
      }
    _files.end(then);
  }
  catch (const RunError&)
  {
    int rank = 0;
    MPI_Comm_rank(comm(), &rank);
    std::error_code of_no_consequence;
    if (rank == 0)
      std::filesystem::remove(_path, of_no_consequence);
    throw;
  }
}

void SeriesFile::end_frame()
{
  _description += end_of_frame;
  write_file([&] { return _xdmf.append(_description); });
  ++_n_frames;
}

void SeriesFile::end_single()
{
  write_file([&] { return _xdmf.write_single(_description); });
}

void SeriesFile::close()
{
  if (std::exchange(_closed, true))
    return;
  _files.close();
  on_first_rank([&] { return _xdmf.finish(); });
}

template <class F>
void SeriesFile::on_first_rank(F&& work)
{
  int rank = 0;
  MPI_Comm_rank(comm(), &rank);
  if (const std::string failure = shared_failure(comm(), rank == 0 ? work() : ""); !failure.empty())
    throw RunError(failure);
}

ParticleSeries::ParticleSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage)
    : _series(comm, path, "particles", storage)
{
}

void ParticleSeries::write(double time, const OutputField& position, const std::vector<OutputField>& fields,
                           const std::vector<OutputIndexField>& index_fields, const std::string& failure)
{
  require_frame(comm(), time, failure.empty() ? fields_error(fields, index_fields, position.rows) : failure, {&fields},
                index_fields);
  const RowSlice rows = row_slice(comm(), position.rows);
  _series.begin_frame(time);
  XdmfData vertices = _vertices;
  std::vector<std::int64_t> numbers;
  if (rows.total != vertices.rows)
  {
    numbers.resize(static_cast<std::size_t>(rows.local));
    std::iota(numbers.begin(), numbers.end(), rows.before);
    vertices = _series.add_integers("vertices", rows, 1, numbers);
  }
  const XdmfData points = _series.add_grid("Polyvertex", vertices, rows, position);
  // Named as a field as well: some readers give the points of the first frame only. It costs no space.
  _series.add_field("position", "Node", points);
  _series.add_fields("Node", rows, fields);
  _series.add_index_fields("Node", rows, index_fields);
  _series.end_frame();
  _vertices = vertices;
}

MeshSeries::MeshSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage, int dimension,
                       std::span<const double> points, std::span<const std::int64_t> cells,
                       const std::vector<OutputField>& fixed)
    : _series(comm, path, "mesh", storage),
      _nodes(row_slice(comm, points.size() / static_cast<std::size_t>(dimension))),
      _cells(row_slice(comm, cells.size() / static_cast<std::size_t>(dimension + 1)))
{
  require_frame(comm, 0, fields_error(fixed, {}, static_cast<std::size_t>(_cells.local)), {&fixed}, {});
  std::vector<std::int64_t> numbers(cells.begin(), cells.end());
  for (std::int64_t& node : numbers)
    node += _nodes.before;
  const OutputField nodes = row_field("points", points, dimension);
  _series.begin_single("mesh");
  const XdmfData topology = _series.add_integers("cells", _cells, dimension + 1, numbers);
  _series.add_grid(dimension == 2 ? "Triangle" : "Tetrahedron", topology, _nodes, nodes);
  _series.add_fields("Cell", _cells, fixed);
  _grid = _series.description();
  _series.end_single();
}

void MeshSeries::write(double time, const std::vector<OutputField>& node_fields,
                       const std::vector<OutputField>& cell_fields, const std::string& failure)
{
  std::string error = failure;
  if (error.empty())
    error = fields_error(node_fields, {}, static_cast<std::size_t>(_nodes.local));
  if (error.empty())
    error = fields_error(cell_fields, {}, static_cast<std::size_t>(_cells.local));
  require_frame(comm(), time, error, {&node_fields, &cell_fields}, {});
  _series.begin_frame(time);
  _series.add_description(_grid);
  _series.add_fields("Node", _nodes, node_fields);
  _series.add_fields("Cell", _cells, cell_fields);
  _series.end_frame();
}
} // namespace mpm
