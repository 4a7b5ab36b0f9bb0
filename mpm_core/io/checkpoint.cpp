#include "io/checkpoint.h"

#include "io/checkpoint_checks.h"
#include "io/hdf5_input.h"
#include "io/stamp.h"
#include "parallel/redistribution.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstring>

namespace mpm::io
{
namespace
{
/// Of the table that says which cells each rank owns.
constexpr char owned_cells_name[] = "owned_cells";

/// Whether the columns of a field hold real numbers.
template <class Columns>
inline constexpr bool is_real =
    std::is_same_v<typename decltype(columns_of(std::declval<Columns&>()))::value_type, Column>;

template <int D>
void write_particles(Hdf5File& file, const Mesh<D>& mesh, const Particles<D>& particles)
{
  const RowSlice rows = row_slice(file.comm(), particles.id.size());
  const auto n = particles.id.size();
  const auto write_field = [&](const Field& field, const auto& columns)
  {
    if (!is_present(columns))
      return;
    const auto all = columns_of(columns);
    const std::string name = "/particles/" + std::string(field.name);
    if constexpr (is_real<const std::remove_cvref_t<decltype(columns)>>)
    {
      std::vector<double> values(n * all.size());
      for (std::size_t k = 0; k < all.size(); ++k)
        for (std::size_t p = 0; p < n; ++p)
          values[p * all.size() + k] = all[k][p];
      file.write<double>(name, rows, static_cast<int>(all.size()), values);
    }
    else
    {
      std::vector<std::int64_t> values(all[0].begin(), all[0].end());
      if (field.name == "cell")
        for (auto& value : values)
          value = mesh.global_cells[static_cast<std::size_t>(value)];
      file.write<std::int64_t>(name, rows, 1, values);
    }
  };
  for_each_field(particles, write_field);
}

void write_tables(Hdf5File& file, std::size_t particles, const StateTables& state)
{
  const RowSlice one = row_slice(file.comm(), 1);
  auto write_count = [&](const std::string& name, std::size_t count)
  {
    const auto value = static_cast<std::int64_t>(count);
    file.write<std::int64_t>("/ranks/rows_of_" + name, one, 1, {&value, 1});
  };
  write_count("particles", particles);
  for (const Table& table : state.cells)
  {
    const std::size_t count = table.values.size() / static_cast<std::size_t>(table.width);
    write_count(table.name, count);
    file.write<double>("/cells/" + table.name, row_slice(file.comm(), count), table.width, table.values);
  }
  for (const Table& table : state.ranks)
    file.write<double>("/ranks/" + table.name, one, table.width, table.values);
}

/// Moves the finished file to its name, and sees to it that the name is on the disk too.
std::string put_in_place(const std::filesystem::path& aside, const std::filesystem::path& path)
{
  std::error_code error;
  std::filesystem::rename(aside, path, error);
  if (error)
    return error.message();
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  const int directory = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool flushed = directory >= 0 && (::fsync(directory) == 0 || errno == EINVAL); // some file systems cannot
  std::string failure = flushed ? "" : std::strerror(errno);
  if (directory >= 0)
    ::close(directory);
  return failure;
}

/// A field of real numbers.
template <class Columns>
void read_real(Hdf5Input& file, const Field& field, const RowSlice& rows, Columns& columns)
{
  const auto all = columns_of(columns);
  const std::string name(field.name), array = "/particles/" + name;
  const auto n = static_cast<std::size_t>(rows.local);
  if constexpr (is_optional<Columns>)
  {
    if (!file.has(array))
      return;
    require(columns, n, field.initial);
  }
  if (all.empty())
    return;
  auto values = file.read<double>(array, rows, static_cast<int>(all.size()));
  values.resize(n * all.size());
  check_values(file, name, values);
  for (std::size_t k = 0; k < all.size(); ++k)
    for (std::size_t p = 0; p < n; ++p)
      all[k][p] = values[p * all.size() + k];
}

/// The rows of particles, and the numbers of their cells over all ranks.
template <int D>
std::vector<GlobalIndex> read_particles(Hdf5Input& file, const RowSlice& rows, std::size_t materials,
                                        Particles<D>& particles)
{
  file.read<std::int64_t>("/particles/id", rows, 1); // so many rows are there, before memory is taken for them
  file.check();
  resize(particles, static_cast<Index>(rows.local));
  std::vector<GlobalIndex> cells;
  const auto read_field = [&](const Field& field, auto& columns)
  {
    if constexpr (is_real<std::remove_cvref_t<decltype(columns)>>)
      read_real(file, field, rows, columns);
    else
    {
      auto values = file.read<std::int64_t>("/particles/" + std::string(field.name), rows, 1);
      values.resize(static_cast<std::size_t>(rows.local));
      if (field.name == "material")
        check_materials(file, values, materials);
      if (field.name == "cell")
        cells = values;
      else
        std::ranges::transform(values, columns.begin(),
                               [](std::int64_t value)
                               { return static_cast<std::remove_cvref_t<decltype(columns[0])>>(value); });
    }
  };
  for_each_field(particles, read_field);
  return cells;
}

/// Whether each rank of now has the cells that the same rank of the file had particles in.
template <int D>
bool are_same_parts(const NodeExchange& exchange, const Mesh<D>& mesh, const std::vector<GlobalIndex>& cells,
                    Particles<D>& particles)
{
  const auto numbers = owned_cell_numbers(mesh);
  int same = 1;
  for (std::size_t p = 0; p < cells.size(); ++p)
    if (const auto found = numbers.find(cells[p]); found != numbers.end())
      particles.cell[p] = found->second;
    else
      same = 0;
  MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, exchange.comm);
  return same == 1;
}
} // namespace

template <int D>
void write_checkpoint(MPI_Comm comm, const std::filesystem::path& path, const Mesh<D>& mesh,
                      const Particles<D>& particles, const StateTables& state, const std::string& description)
{
  const std::filesystem::path aside = path.string() + ".part";
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  try
  {
    Hdf5File file(comm, aside, stamp_size);
    for (const char* group : {"/particles", "/cells", "/ranks"})
      file.create_group(group);
    file.write_text("description", description);
    write_particles(file, mesh, particles);
    write_tables(file, particles.id.size(), state);
    file.check();
    file.close();
    stamp_file(comm, aside);
    const std::string failure = rank == 0 ? put_in_place(aside, path) : "";
    if (const std::string text = shared_failure(comm, failure); !text.empty())
      throw RunError("cannot write " + path.string() + ": " + text);
  }
  catch (const RunError&)
  {
    std::error_code ignored;
    if (rank == 0)
      std::filesystem::remove(aside, ignored);
    throw;
  }
}

std::string checkpoint_description(MPI_Comm comm, const std::filesystem::path& path)
{
  check_stamp(comm, path);
  Hdf5Input file(comm, path);
  std::string text = file.read_text("description");
  file.check();
  return text;
}

template <int D>
Table owned_cells_table(const Mesh<D>& mesh)
{
  return {owned_cells_name, 1, {mesh.global_cells.begin(), mesh.global_cells.begin() + mesh.owned_cells}};
}

std::vector<GlobalIndex> checkpoint_cells(MPI_Comm comm, const std::filesystem::path& path)
{
  Hdf5Input file(comm, path);
  const std::string array = std::string("/cells/") + owned_cells_name;
  const auto cells = file.read<double>(array, own_rows(file, comm, owned_cells_name, array), 1);
  for (double cell : cells)
    if (!(cell >= 0 && cell < most_exact))
      file.reject(array, "it has the cell " + std::to_string(cell));
  file.check();
  return {cells.begin(), cells.end()};
}

template <int D>
Checkpoint<D> read_checkpoint(const NodeExchange& exchange, const std::filesystem::path& path, const Mesh<D>& mesh,
                              const Particles<D>& fields, std::size_t materials, const StateTables& expected)
{
  Hdf5Input file(exchange.comm, path);
  const GlobalIndex ranks = countable_rows(file, "/ranks/rows_of_particles");
  const GlobalIndex total = countable_rows(file, "/particles/id");
  Checkpoint<D> checkpoint;
  Particles<D>& particles = checkpoint.particles;
  particles = empty_like(fields);
  checkpoint.same_parts = false;
  if (ranks == exchange.size)
  {
    const RowSlice rows = own_rows(file, exchange.comm, "particles", "/particles/id");
    const auto cells = read_particles(file, rows, materials, particles);
    file.check();
    checkpoint.same_parts = are_same_parts(exchange, mesh, cells, particles);
  }
  if (!checkpoint.same_parts)
  {
    particles = empty_like(fields);
    const GlobalIndex first = total * exchange.rank / exchange.size, last = total * (exchange.rank + 1) / exchange.size;
    const auto cells = read_particles(file, {first, last - first, total}, materials, particles);
    file.check();
    try
    {
      redistribute<D>(mesh, exchange, cells, particles);
    }
    catch (const RunError& error)
    {
      throw RunError("cannot read /particles/cell in " + path.string() + ": " + error.what());
    }
  }
  check_positions<D>(file, mesh, particles);
  file.check();
  checkpoint.state = expected;
  std::erase_if(checkpoint.state.ranks, // of the energy balance and the order, which older files do not have
                [&](const Table& table)
                {
                  const bool may_lack = table.name.starts_with("energy_") || table.name.starts_with("order_");
                  return may_lack && !file.has("/ranks/" + table.name);
                });
  const RowSlice rows = checkpoint.same_parts ? RowSlice{exchange.rank, 1, ranks} : RowSlice{0, ranks, ranks};
  for (Table& table : checkpoint.state.ranks)
  {
    table.values = file.read<double>("/ranks/" + table.name, rows, table.width);
    check_totals(file, table, static_cast<std::size_t>(rows.local));
  }
  if (!checkpoint.same_parts)
    checkpoint.state.cells.clear();
  std::erase_if(checkpoint.state.cells, [&](const Table& table) { return !file.has("/cells/" + table.name); });
  for (Table& table : checkpoint.state.cells)
  {
    const std::string array = "/cells/" + table.name;
    table.values = file.read<double>(array, own_rows(file, exchange.comm, table.name, array), table.width);
    check_cells(file, mesh, table);
    if (table.name == "traction_moments" && !file.has("/particles/traction"))
      file.reject(array, "the particles have no traction");
  }
  file.check();
  return checkpoint;
}

template <int D>
std::uint64_t mesh_fingerprint(MPI_Comm comm, const Mesh<D>& mesh)
{
  auto point_hash = [&](Index node)
  {
    std::uint64_t hash = 0;
    for (double x : mesh.points[node])
      hash = mixed(hash ^ std::bit_cast<std::uint64_t>(x + 0.0)); // + 0.0 makes one zero of the two
    return hash;
  };
  // Sums, because neither the order of cells nor that of a cell's vertices is the same on all partitions.
  std::uint64_t sum = 0;
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    std::uint64_t cell = 0;
    for (int k = 0; k <= D; ++k)
    {
      const std::uint64_t point = point_hash(mesh.cells[c][k]);
      cell += mixed(point) + mixed(point ^ mixed(static_cast<std::uint64_t>(mesh.facet_tags[c][k])));
    }
    cell = mixed(cell ^ static_cast<std::uint64_t>(mesh.cell_tags[c]));
    sum += mixed(cell ^ mixed(static_cast<std::uint64_t>(mesh.global_cells[c])));
  }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_UINT64_T, MPI_SUM, comm);
  return sum;
}

#define INSTANTIATE(D)                                                                                                 \
  template void write_checkpoint(MPI_Comm, const std::filesystem::path&, const Mesh<D>&, const Particles<D>&,          \
                                 const StateTables&, const std::string&);                                              \
  template Checkpoint<D> read_checkpoint(const NodeExchange&, const std::filesystem::path&, const Mesh<D>&,            \
                                         const Particles<D>&, std::size_t, const StateTables&);                        \
  template Table owned_cells_table(const Mesh<D>&);                                                                    \
  template std::uint64_t mesh_fingerprint(MPI_Comm, const Mesh<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::io
