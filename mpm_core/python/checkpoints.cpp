#include "model/moving_cells.h"
#include "model/state.h"
#include "parallel/agreement.h"
#include "parallel/redistribution.h"
#include "python/bindings.h"
#include "python/particle_columns.h"

#include <algorithm>

namespace mpm::python
{
namespace
{
/// Rows of a table as an array: (n,), or (n, width).
py::array_t<double> table_array(const Table& table)
{
  const auto width = static_cast<py::ssize_t>(table.width), n = static_cast<py::ssize_t>(table.values.size()) / width;
  const std::vector<py::ssize_t> shape = width == 1 ? std::vector{n} : std::vector{n, width};
  return py::array_t<double>(shape, table.values.data());
}

/// Arrays of a checkpoint that have rows of this rank, beside those of the particles, in groups.
/// @note Collective
template <class G, int D = G::dim>
py::dict checkpoint_arrays(Model<G>& model)
{
  prepare(model);
  py::dict cells, ranks;
  for (const Table& table : cell_state(model))
    cells[py::str(table.name)] = table_array(table);
  for (const Table& table : rank_state(model))
    ranks[py::str(table.name)] = table_array(table);
  using namespace py::literals;
  return py::dict("cells"_a = cells, "ranks"_a = ranks);
}

/// The tables that a checkpoint of the model may have, by name, in groups: widths of those of cells; of those of ranks,
/// which have one column, `most_count`, `is_positive` and `may_be_unknown`.
template <class G, int D = G::dim>
py::dict checkpoint_tables(const Model<G>& model)
{
  py::dict cells, ranks;
  for (const Table& table : empty_cell_state(model))
    cells[py::str(table.name)] = table.width;
  for (const Table& table : rank_state(model))
    ranks[py::str(table.name)] = py::make_tuple(table.most_count, table.is_positive, table.may_be_unknown);
  using namespace py::literals;
  return py::dict("cells"_a = cells, "ranks"_a = ranks);
}

/// Particles with the values of arrays, and the numbers of their cells over all ranks.
template <class G, int D = G::dim>
std::pair<Particles<D>, std::vector<GlobalIndex>> particles_of(const Model<G>& model, const py::dict& arrays)
{
  Particles<D> particles = empty_like(model.particles);
  const auto ids = values<std::int64_t>(arrays["id"].cast<py::array>());
  resize(particles, static_cast<Index>(ids.size()));
  std::vector<GlobalIndex> cells;
  const auto take = [&](const Field& field, auto& columns)
  {
    using Columns = std::remove_cvref_t<decltype(columns)>;
    const std::string name(field.name);
    if (!arrays.contains(name.c_str()))
      return;
    const auto array = arrays[name.c_str()].cast<py::array>();
    if constexpr (std::is_same_v<typename decltype(columns_of(columns))::value_type, Column>)
    {
      if constexpr (is_optional<Columns>)
        require(columns, ids.size(), field.initial);
      set_rows(values<double>(array), columns_of(columns));
    }
    else
    {
      const auto numbers = values<std::int64_t>(array);
      if (name == "cell")
        cells.assign(numbers.begin(), numbers.end());
      else
        std::ranges::transform(numbers, columns.begin(),
                               [](std::int64_t value)
                               { return static_cast<std::remove_cvref_t<decltype(columns[0])>>(value); });
    }
  };
  for_each_field(particles, take);
  return {std::move(particles), std::move(cells)};
}

/// The tables that a file has, with its values.
std::vector<Table> tables_of(std::vector<Table> tables, const py::dict& arrays)
{
  std::erase_if(tables, [&](const Table& table) { return !arrays.contains(table.name.c_str()); });
  for (Table& table : tables)
  {
    const auto numbers = values<double>(arrays[table.name.c_str()].cast<py::array>());
    table.values.assign(numbers.begin(), numbers.end());
  }
  return tables;
}

/// Puts particles into their cells, on the ranks that own them.
/// @note Collective
template <class G, int D = G::dim>
void place(const Model<G>& model, const std::vector<GlobalIndex>& cells, const py::object& owners,
           Particles<D>& particles)
{
  if (!owners.is_none())
    return redistribute<D>(model.mesh, model.exchange, cells, values<std::int64_t>(owners.cast<py::array>()),
                           particles);
  const auto numbers = owned_cell_numbers(model.mesh);
  for (std::size_t p = 0; p < cells.size(); ++p)
    particles.cell[p] = numbers.at(cells[p]);
}

/// Largest distance of a particle outside of its cell, over the cell's height; far more than the search for cells
/// allows.
constexpr double most_outside = 1e-6;

/// What is wrong with a particle that is not in its cell, but for round-off; empty where all are.
template <int D>
std::string misplaced(const Mesh<D>& mesh, const Particles<D>& particles)
{
  for (std::size_t p = 0; p < particles.cell.size(); ++p)
  {
    const Index cell = particles.cell[p];
    const Vector<D> position = at<D>(particles.position, static_cast<Index>(p));
    const auto n = shape_functions<D>(mesh.shapes[cell], position);
    if (*std::min_element(n.begin(), n.end()) >= -most_outside)
      continue;
    std::string place;
    for (double x : position)
      place += (place.empty() ? "(" : ", ") + std::to_string(x);
    return "it has the place " + place + "), which is not in that particle's cell " +
           std::to_string(mesh.global_cells[cell]);
  }
  return {};
}

/// Replaces particles and state of a model by those of a file, whose values have been checked.
/// @param particles   fields of all that the file has; of this rank, or of an equal part where the partition is another
/// @param ranks       of this rank; of all ranks of the file where the partition is another
/// @param owners      rank that owns the cell of each of these particles; None where the partition is that of the file
/// @throws RunError on all ranks, with path and reason: a particle is not in its cell; the model is then as before
/// @note Collective
template <class G, int D = G::dim>
void restore(Model<G>& model, const py::dict& particles, const py::dict& cells, const py::dict& ranks,
             const py::object& owners, const std::string& path)
{
  auto [restored, numbers] = particles_of(model, particles);
  const std::vector<Table> cell_tables = tables_of(empty_cell_state(model), cells),
                           rank_tables = tables_of(rank_state(model), ranks);
  place(model, numbers, owners, restored);
  Mesh<D> mesh = initial_mesh(model);
  MovedCells<D> moved;
  for (const Table& table : cell_tables)
    if (table.name == no_moved_corners<D>().name)
      moved = take_corners(owned_cell_numbers(mesh), table, mesh);
  if (const std::string why = shared_failure(model.exchange.comm, misplaced(mesh, restored)); !why.empty())
    throw RunError("cannot read /particles/position in " + path + ": " + why);
  model.mesh = std::move(mesh);
  model.moved_cells = std::move(moved);
  if (owners.is_none())
    restore_same(model, std::move(restored), rank_tables, cell_tables);
  else
    restore_other(model, std::move(restored), rank_tables);
}

template <class G, int D = G::dim>
void bind(py::module_& m)
{
  m.def("checkpoint_arrays", &checkpoint_arrays<G>);
  m.def("checkpoint_tables", &checkpoint_tables<G>);
  m.def("restore", &restore<G>);
}
} // namespace

void bind_checkpoints(py::module_& m)
{
  bind<PlaneStrain>(m);
  bind<Axisymmetric>(m);
  bind<Solid>(m);
}
} // namespace mpm::python
