#include "model/moving_cells.h"
#include "model/state.h"
#include "parallel/agreement.h"
#include "parallel/redistribution.h"
#include "python/bindings.h"
#include "python/checkpoint_checks.h"
#include "python/particle_columns.h"

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

/// The fields of particles that there are, (n,) or (n, k); cells by their numbers over all ranks.
template <class G, int D = G::dim>
py::dict particle_arrays(const Model<G>& model)
{
  py::dict arrays;
  const std::size_t n = model.particles.id.size();
  const auto add = [&](const Field& field, const auto& columns)
  {
    const auto all = columns_of(columns);
    const py::str name(std::string(field.name));
    if constexpr (std::is_same_v<const Column&, decltype(all[0])>)
    {
      if (is_present(columns) && all.size() > 0)
        arrays[name] = all.size() == 1 ? py::object(copied(all[0])) : py::object(rows(all, n, {}));
    }
    else
    {
      std::vector<std::int64_t> values(all[0].begin(), all[0].end());
      if (field.name == "cell")
        for (auto& value : values)
          value = model.mesh.global_cells[static_cast<std::size_t>(value)];
      arrays[name] = copied(values);
    }
  };
  for_each_field(model.particles, add);
  return arrays;
}

/// All arrays of a checkpoint that have rows of this rank, in groups.
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
  return py::dict("particles"_a = particle_arrays(model), "cells"_a = cells, "ranks"_a = ranks);
}

/// Widths of the tables that a checkpoint of the model may have, by name, in groups.
template <class G, int D = G::dim>
py::dict checkpoint_widths(const Model<G>& model)
{
  py::dict cells, ranks;
  for (const Table& table : empty_cell_state(model))
    cells[py::str(table.name)] = table.width;
  for (const Table& table : rank_state(model))
    ranks[py::str(table.name)] = table.width;
  using namespace py::literals;
  return py::dict("cells"_a = cells, "ranks"_a = ranks);
}

/// Particles with the values of arrays, and the numbers of their cells over all ranks.
template <class G, int D = G::dim>
std::pair<Particles<D>, std::vector<GlobalIndex>> particles_of(const Model<G>& model, const py::dict& arrays,
                                                               Refusal& refusal)
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
      check_values(refusal, name, values<double>(array));
      set_rows(values<double>(array), columns_of(columns));
    }
    else
    {
      const auto numbers = values<std::int64_t>(array);
      if (name == "material")
        check_materials(refusal, numbers, model.laws.size());
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

/// Refuses totals that no run writes.
/// @param ranks  of all ranks of the file
/// @throws RunError with path, array, value and what was expected
template <class G, int D = G::dim>
void check_totals_of(const Model<G>& model, const py::dict& ranks, const std::string& path)
{
  Refusal refusal;
  for (const Table& table : tables_of(rank_state(model), ranks))
    check_totals(refusal, table);
  if (const std::string text = refusal.text(path); !text.empty())
    throw RunError(text);
}

/// Replaces particles and state of a model by those of a file, after all have been checked.
/// @param particles   fields of all that the file has; of this rank, or of an equal part where the partition is another
/// @param ranks       of this rank; of all ranks of the file where the partition is another; see check_totals_of
/// @param owners      rank that owns the cell of each of these particles; None where the partition is that of the file
/// @throws RunError on all ranks, with path, array and reason; the model is then as before
/// @note Collective
template <class G, int D = G::dim>
void restore(Model<G>& model, const py::dict& particles, const py::dict& cells, const py::dict& ranks,
             const py::object& owners, const std::string& path)
{
  const auto agree = [&](const Refusal& refusal)
  {
    if (const std::string text = shared_failure(model.exchange.comm, refusal.text(path)); !text.empty())
      throw RunError(text);
  };
  Refusal refusal;
  auto [restored, numbers] = particles_of(model, particles, refusal);
  const std::vector<Table> cell_tables = tables_of(empty_cell_state(model), cells),
                           rank_tables = tables_of(rank_state(model), ranks);
  agree(refusal);
  place(model, numbers, owners, restored);
  for (const Table& table : cell_tables)
  {
    check_cells(refusal, model.mesh, table);
    if (table.name == "traction_moments" && !particles.contains("traction"))
      refusal.note("/cells/" + table.name, "the particles have no traction");
  }
  agree(refusal);
  Mesh<D> mesh = initial_mesh(model);
  MovedCells<D> moved;
  for (const Table& table : cell_tables)
    if (table.name == no_moved_corners<D>().name)
      moved = take_corners(owned_cell_numbers(mesh), table, mesh);
  check_positions(refusal, mesh, restored);
  agree(refusal);
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
  m.def("checkpoint_widths", &checkpoint_widths<G>);
  m.def("check_totals", &check_totals_of<G>);
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
