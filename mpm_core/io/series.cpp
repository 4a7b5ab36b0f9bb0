#include "io/series.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <tuple>

namespace mpm::io
{
namespace
{
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

std::string error_of(const ParticleFields& fields)
{
  return fields_error(fields.fields, fields.index_fields, fields.position.rows);
}

std::string error_of(const MeshFields& fields, std::size_t n_nodes, std::size_t n_cells)
{
  std::string error = fields_error(fields.nodes, {}, n_nodes);
  return error.empty() ? fields_error(fields.cells, {}, n_cells) : error;
}

std::string error_of(const Frame& frame)
{
  if (!frame.failure.empty())
    return frame.failure;
  if (!std::isfinite(frame.time))
    return "time is " + std::to_string(frame.time) + ", expected a finite number of seconds";
  std::string error = frame.particles ? error_of(frame.particle_fields) : "";
  return error.empty() && frame.mesh ? error_of(frame.mesh_fields, frame.mesh->n_nodes(), frame.mesh->n_cells())
                                     : error;
}

std::string names_of(const std::vector<OutputField>& fields)
{
  std::string names;
  for (const OutputField& field : fields)
    names += field.name + ":" + std::to_string(field.columns.size()) + ",";
  return names;
}

std::string names_of(const std::vector<OutputIndexField>& fields)
{
  std::string names;
  for (const OutputIndexField& field : fields)
    names += field.name + ",";
  return names;
}

std::string other_fields(const std::string& names) { return "fields are not the same on all ranks; here: " + names; }

bool is_wide(const OutputIndexField& field)
{
  const auto fits = [](auto v) { return v == static_cast<std::int32_t>(v); };
  return !std::visit([&](auto values) { return std::ranges::all_of(values, fits); }, field.values);
}

Number narrowest(std::int64_t largest)
{
  return largest > std::numeric_limits<std::int32_t>::max() ? Number::int64 : Number::int32;
}

/// What a rank tells the others before a frame is written.
struct Notice
{
  std::uint64_t failed, names, particles;
  std::uint64_t wide; ///< a bit for each index field, by turns where there are more
};

/// What ranks know of each other then.
struct Notices
{
  RowSlice particles;
  std::vector<bool> wide; ///< index fields with values that do not fit into 32 bits, on any rank
};

/// Tells everything by one exchange, since there are many frames.
/// @throws InputError as `write` does
Notices noticed(MPI_Comm comm, const Frame& frame)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  const auto& [particles, mesh] = std::tie(frame.particle_fields, frame.mesh_fields);
  const auto bit = [](std::size_t k) { return std::uint64_t{1} << k % 64; };
  const std::string error = error_of(frame), names = names_of(particles.fields) + names_of(particles.index_fields) +
                                                     names_of(mesh.nodes) + names_of(mesh.cells);
  Notice own{!error.empty(), std::hash<std::string>{}(names), particles.position.rows, 0};
  for (std::size_t k = 0; k < particles.index_fields.size(); ++k)
    own.wide |= is_wide(particles.index_fields[k]) ? bit(k) : 0;
  static_assert(sizeof(Notice) == 4 * sizeof(std::uint64_t));
  std::vector<Notice> all(static_cast<std::size_t>(size), own);
  if (size > 1) // alone, it is not worth getting MPI's code into the cache
    MPI_Allgather(&own, 4, MPI_UINT64_T, all.data(), 4, MPI_UINT64_T, comm);
  std::uint64_t wide = 0;
  bool failed = false, same = true;
  Notices notices{.particles = {.local = static_cast<GlobalIndex>(own.particles)}, .wide = {}};
  for (const Notice& notice : all)
  {
    failed = failed || notice.failed;
    same = same && notice.names == own.names;
    wide |= notice.wide;
    notices.particles.before += &notice - all.data() < rank ? static_cast<GlobalIndex>(notice.particles) : 0;
    notices.particles.total += static_cast<GlobalIndex>(notice.particles);
  }
  if (failed)
    throw InputError(shared_failure(comm, error));
  if (!same)
    throw InputError(other_fields(names));
  for (std::size_t k = 0; k < particles.index_fields.size(); ++k)
    notices.wide.push_back(wide & bit(k));
  return notices;
}

int last_rank(MPI_Comm comm)
{
  int size = 1;
  MPI_Comm_size(comm, &size);
  return size - 1;
}
} // namespace

void require_same_fields(MPI_Comm comm, const std::string& error, const std::string& names)
{
  const auto [failure, same] = agreement(comm, error, names);
  if (!failure.empty())
    throw InputError(failure);
  if (!same)
    throw InputError(other_fields(names));
}

// Particles and mesh are written by different ranks, at the same time.

ParticleSeries::ParticleSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage)
    : _file(comm, path, "particles", storage, 0)
{
}

void ParticleSeries::begin(double time, const ParticleFields& fields, const RowSlice& rows,
                           const std::vector<bool>& wide)
{
  _file.begin_frame(time);
  if (rows.total != _vertices.rows || _vertices_in == _file.n_frames()) // that frame was not written
  {
    _numbers.resize(static_cast<std::size_t>(rows.local));
    std::iota(_numbers.begin(), _numbers.end(), rows.before);
    _vertices = _file.add_integers("vertices", rows, 1, narrowest(rows.total), _numbers);
    _vertices_in = _file.n_frames();
  }
  const XdmfData points = _file.add_grid("Polyvertex", _vertices, rows, fields.position);
  // Named as a field as well: some readers give the points of the first frame only. It costs no space.
  _file.add_field("position", "Node", points);
  _file.add_fields("Node", rows, fields.fields);
  for (std::size_t k = 0; k < wide.size(); ++k)
  {
    const auto& [name, values] = fields.index_fields[k];
    _file.add_field(name, "Node", _file.add_integers(name, rows, 1, wide[k] ? Number::int64 : Number::int32, values));
  }
}

MeshSeries::MeshSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage, int dimension,
                       std::span<const double> points, std::span<const std::int64_t> cells,
                       const std::vector<OutputField>& fixed)
    : _file(comm, path, "mesh", storage, last_rank(comm)),
      _nodes(row_slice(comm, points.size() / static_cast<std::size_t>(dimension))),
      _cells(row_slice(comm, cells.size() / static_cast<std::size_t>(dimension + 1)))
{
  require_same_fields(comm, fields_error(fixed, {}, n_cells()), names_of(fixed));
  std::vector<std::int64_t> numbers(cells.begin(), cells.end());
  for (std::int64_t& node : numbers)
    node += _nodes.before;
  const OutputField nodes = row_field("points", points, dimension);
  _file.begin_single("mesh");
  const XdmfData topology = _file.add_integers("cells", _cells, dimension + 1, narrowest(_nodes.total), numbers);
  _file.add_grid(dimension == 2 ? "Triangle" : "Tetrahedron", topology, _nodes, nodes);
  _file.add_fields("Cell", _cells, fixed);
  _grid = _file.description();
  SeriesFile::write({&_file});
}

void MeshSeries::begin(double time, const MeshFields& fields)
{
  _file.begin_frame(time);
  _file.add_description(_grid);
  _file.add_fields("Node", _nodes, fields.nodes);
  _file.add_fields("Cell", _cells, fields.cells);
}

void write(MPI_Comm comm, const Frame& frame)
{
  const Notices notices = noticed(comm, frame);
  std::vector<SeriesFile*> files;
  if (frame.particles)
  {
    frame.particles->begin(frame.time, frame.particle_fields, notices.particles, notices.wide);
    files.push_back(&frame.particles->file());
  }
  if (frame.mesh)
  {
    frame.mesh->begin(frame.time, frame.mesh_fields);
    files.push_back(&frame.mesh->file());
  }
  SeriesFile::write(files);
}
} // namespace mpm::io
