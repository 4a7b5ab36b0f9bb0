#include "io/series_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <numeric>
#include <utility>

namespace mpm::io
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

/// Puts rows that ranks want, here or elsewhere, where they belong among all ranks' rows.
template <class T>
void scatter_columns(std::span<const OutputColumn> columns, std::span<const RowCarrier::Given> given, int width,
                     std::span<T> rows)
{
  for (const auto& [row, wanted_as] : given)
  {
    T* to = rows.data() + wanted_as * width;
    for (const OutputColumn& column : columns)
      *to++ = static_cast<T>(column[static_cast<std::size_t>(row)]);
    std::fill(to, rows.data() + (wanted_as + 1) * width, T(0));
  }
}

template <class T>
void copy_numbers(const WholeNumbers& numbers, std::span<T> to)
{
  std::visit([&](auto values) { std::ranges::transform(values, to.begin(), [](auto v) { return static_cast<T>(v); }); },
             numbers);
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

SeriesFile::SeriesFile(MPI_Comm comm, const std::filesystem::path& path, std::string grid, Storage storage, int writer)
    : _files(comm, storage.compression, writer), _folder(without_suffix(path)), _folder_name(_folder.filename()),
      _xdmf(_folder.string() + ".xdmf", std::move(grid)), _precision(storage.precision)
{
  if (!is_same_on_all_ranks(comm, _folder))
    throw RunError("path is not the same on all ranks; here: " + _folder.string());
  on_writer([&] { return prepared_folder(_folder); });
  on_writer([&] { return _xdmf.write_without_frames(); });
}

void SeriesFile::begin(const std::string& file)
{
  if (_closed)
    throw RunError("cannot write " + _folder.string() + ": it is closed");
  _path = _folder.native() + "/" + file; // quicker than by the library's paths
  _address = _folder_name + "/" + file + ":/";
  _datasets.clear();
  _sources.clear();
  _description.clear();
}

void SeriesFile::begin_frame(double time)
{
  begin(frame_file(_n_frames));
  _single = false;
  if (_files.is_writer())
    _description += begin_of_frame(time);
}

void SeriesFile::begin_single(const std::string& name)
{
  begin(name + ".h5");
  _single = true;
}

void SeriesFile::add_description(const std::string& text)
{
  if (_files.is_writer())
    _description += text;
}

XdmfData SeriesFile::add(Dataset dataset, Source source)
{
  const bool integer = dataset.number == Number::int32 || dataset.number == Number::int64;
  XdmfData data{_address + dataset.name, dataset.rows.total, dataset.width, integer,
                static_cast<int>(bytes_of(dataset.number))};
  _datasets.push_back(std::move(dataset));
  _sources.push_back(source);
  return data;
}

XdmfData SeriesFile::add_reals(const std::string& name, const RowSlice& rows, std::span<const OutputColumn> columns,
                               int width, RowCarrier* carrier)
{
  const Number number = _precision == Precision::float32 ? Number::float32 : Number::float64;
  return add({name, rows, width, number}, {columns, carrier, {}});
}

XdmfData SeriesFile::add_integers(const std::string& name, const RowSlice& rows, int width, Number number,
                                  const WholeNumbers& values)
{
  return add({name, rows, width, number}, {{}, nullptr, values});
}

XdmfData SeriesFile::add_grid(const char* type, const XdmfData& cells, const RowSlice& rows, const OutputField& points)
{
  XdmfData geometry = add_reals(points.name, rows, points.columns, 3);
  if (_files.is_writer())
  {
    add_topology(_description, type, cells);
    add_geometry(_description, geometry);
  }
  return geometry;
}

void SeriesFile::add_field(const std::string& name, const char* center, const XdmfData& data)
{
  if (_files.is_writer())
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
        const char* component = n == 4 && k == 2 ? field.out_of_plane : component_names[k];
        const std::string name = field.name + "_" + component;
        add_field(name, center, add_reals(name, rows, columns.subspan(k, 1), 1, field.carrier));
      }
    else
      add_field(field.name, center,
                add_reals(field.name, rows, columns, n == 2 ? 3 : static_cast<int>(n), field.carrier));
  }
}

template <class T>
void SeriesFile::copy_reals(const Dataset& dataset, const Source& source)
{
  const std::span<T> rows = _files.next<T>(), all = _files.whole<T>();
  const std::span<const OutputColumn> columns = source.columns;
  const std::size_t n = columns.size();
  if (!source.carrier)
    copy_columns(columns, dataset.width, rows);
  else if (!all.empty())
    scatter_columns(columns, source.carrier->given(), dataset.width, all);
  else
  {
    const auto pack = [&](std::size_t row, double* to)
    { std::ranges::transform(columns, to, [&](const OutputColumn& column) { return column[row]; }); };
    const OutputField carried = row_field({}, source.carrier->carry(n, pack), static_cast<int>(n));
    copy_columns(std::span<const OutputColumn>(carried.columns), dataset.width, rows);
  }
}

void SeriesFile::fill()
{
  const std::vector<Dataset>& datasets = _files.begin(_path, std::move(_datasets));
  for (std::size_t k = 0; k < datasets.size(); ++k)
    switch (datasets[k].number)
    {
    case Number::float32:
      copy_reals<float>(datasets[k], _sources[k]);
      break;
    case Number::float64:
      copy_reals<double>(datasets[k], _sources[k]);
      break;
    case Number::int32:
      copy_numbers(_sources[k].whole, _files.next<std::int32_t>());
      break;
    case Number::int64:
      copy_numbers(_sources[k].whole, _files.next<std::int64_t>());
      break;
    }
  _files.complete();
}

std::string SeriesFile::finish()
{
  std::string failure = _files.write();
  if (!failure.empty() || !_files.is_writer())
    return failure;
  if (_single)
    return _xdmf.write_single(_description);
  _description += end_of_frame;
  return _xdmf.append(_description);
}

void SeriesFile::discard()
{
  _files.forget();
  std::error_code of_no_consequence;
  if (_files.is_writer())
    std::filesystem::remove(_path, of_no_consequence);
}

void SeriesFile::write(const std::vector<SeriesFile*>& series)
{
  try
  {
    for (SeriesFile* file : series)
      file->fill();
  }
  catch (const RunError&)
  {
    for (SeriesFile* file : series)
      file->discard();
    throw;
  }
  std::vector<std::string> failures;
  failures.reserve(series.size());
  for (SeriesFile* file : series)
    failures.push_back(file->finish());
  const auto first = std::ranges::find_if(failures, [](const std::string& failure) { return !failure.empty(); });
  const MPI_Comm comm = series[0]->comm();
  const std::string shared = shared_failure(comm, first == failures.end() ? "" : *first);
  for (std::size_t k = 0; k < series.size(); ++k)
    if (shared.empty() || shared_failure(comm, failures[k]).empty())
      series[k]->_n_frames += series[k]->_single ? 0 : 1;
    else
      series[k]->discard();
  if (!shared.empty())
    throw RunError(shared);
}

void SeriesFile::close()
{
  if (std::exchange(_closed, true))
    return;
  _files.close();
  on_writer([&] { return _xdmf.finish(); });
}

template <class F>
void SeriesFile::on_writer(F&& work)
{
  if (const std::string failure = shared_failure(comm(), _files.is_writer() ? work() : ""); !failure.empty())
    throw RunError(failure);
}
} // namespace mpm::io
