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
    throw InputError("fields are not the same on all ranks; here: " + names);
}

// Particles and mesh are written by different ranks, at the same time.

ParticleSeries::ParticleSeries(MPI_Comm comm, const std::filesystem::path& path, Storage storage)
    : _file(comm, path, "particles", storage, 0)
{
}

void ParticleSeries::begin(double time, const ParticleFields& fields)
{
  const RowSlice rows = row_slice(_file.comm(), fields.position.rows);
  _file.begin_frame(time);
  if (rows.total != _vertices.rows || _vertices_in == _file.n_frames()) // that frame was not written
  {
    _numbers.resize(static_cast<std::size_t>(rows.local));
    std::iota(_numbers.begin(), _numbers.end(), rows.before);
    _vertices = _file.add_integers("vertices", rows, 1, _numbers);
    _vertices_in = _file.n_frames();
  }
  const XdmfData points = _file.add_grid("Polyvertex", _vertices, rows, fields.position);
  // Named as a field as well: some readers give the points of the first frame only. It costs no space.
  _file.add_field("position", "Node", points);
  _file.add_fields("Node", rows, fields.fields);
  _file.add_index_fields("Node", rows, fields.index_fields);
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
  const XdmfData topology = _file.add_integers("cells", _cells, dimension + 1, numbers);
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
  const auto& [particles, mesh] = std::tie(frame.particle_fields, frame.mesh_fields);
  require_same_fields(comm, error_of(frame),
                      names_of(particles.fields) + names_of(particles.index_fields) + names_of(mesh.nodes) +
                          names_of(mesh.cells));
  std::vector<SeriesFile*> files;
  if (frame.particles)
  {
    frame.particles->begin(frame.time, particles);
    files.push_back(&frame.particles->file());
  }
  if (frame.mesh)
  {
    frame.mesh->begin(frame.time, mesh);
    files.push_back(&frame.mesh->file());
  }
  SeriesFile::write(files);
}
} // namespace mpm
