#pragma once
/// @file
/// Fields of particles by name, as NumPy arrays.

#include "model/model.h"
#include "model/water_mapping.h"
#include "python/field_views.h"

#include <pybind11/stl.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace mpm::python
{
using RowNumbers = py::array_t<std::int64_t, py::array::c_style>;
/// Rows of particles, or none for all.
using ChosenRows = std::optional<RowNumbers>;

/// @throws InputError for a row that is not there
inline void require_rows(const RowNumbers& rows, std::size_t size)
{
  for (const std::int64_t row : values<std::int64_t>(rows))
    if (row < 0 || row >= static_cast<std::int64_t>(size))
      throw InputError("rows has " + std::to_string(row) + ", expected 0 to " +
                       std::to_string(static_cast<std::int64_t>(size) - 1) + ", as there are particles on this rank");
}

/// @param rows  numbers of rows, or whether each row is chosen
/// @throws InputError for other arrays, or a row that is not there
template <class G, int D = G::dim>
RowNumbers row_numbers(const Model<G>& model, const py::array& rows)
{
  const std::size_t size = model.particles.id.size();
  const char kind = rows.dtype().kind();
  if (kind == 'b')
  {
    const py::array_t<bool, py::array::c_style> mask(rows);
    check_array<bool>("rows", mask, {static_cast<py::ssize_t>(size)});
    std::vector<std::int64_t> chosen;
    for (std::size_t p = 0; const bool is_chosen : values<bool>(mask))
    {
      if (is_chosen)
        chosen.push_back(static_cast<std::int64_t>(p));
      ++p;
    }
    return copied(chosen);
  }
  if (rows.ndim() != 1 || (kind != 'i' && kind != 'u' && rows.size() > 0))
    throw InputError("rows has shape " + shape_text(rows) + " and dtype " + py::str(rows.dtype()).cast<std::string>() +
                     ", expected whole numbers in the shape (m,), or bool for each particle");
  auto numbers = rows.cast<py::array_t<std::int64_t, py::array::c_style | py::array::forcecast>>();
  require_rows(numbers, size);
  return numbers;
}

/// The row of each of some particles; -1 for those that are not on this rank.
template <class G, int D = G::dim>
py::array_t<std::int64_t> find_rows(const Model<G>& model, const std::vector<std::int64_t>& ids)
{
  std::vector<std::pair<std::int64_t, std::size_t>> wanted; // by rising number, and the place among `ids`
  wanted.reserve(ids.size());
  for (const std::int64_t id : ids)
    wanted.emplace_back(id, wanted.size());
  std::ranges::sort(wanted);
  std::vector<std::int64_t> rows(ids.size(), -1);
  for (std::size_t p = 0; p < model.particles.id.size(); ++p)
  {
    const std::int64_t id = model.particles.id[p];
    for (auto found = std::ranges::lower_bound(wanted, std::pair(id, std::size_t{0}));
         found != wanted.end() && found->first == id; ++found)
      rows[found->second] = static_cast<std::int64_t>(p);
  }
  return copied(rows);
}

/// A copy of the chosen particles' values.
template <class T, class Allocator>
py::array_t<T> chosen_of(const std::vector<T, Allocator>& column, const ChosenRows& chosen)
{
  if (!chosen)
    return copied(column);
  py::array_t<T> array(chosen->size());
  std::ranges::transform(values<std::int64_t>(*chosen), array.mutable_data(),
                         [&](std::int64_t row) { return column[static_cast<std::size_t>(row)]; });
  return array;
}

/// Columns of a vector or tensor field as rows of a new array, of the chosen particles.
template <class C>
py::array_t<double> rows(const C& columns, std::size_t size, const ChosenRows& chosen)
{
  const std::size_t width = columns.size();
  const std::int64_t* const row = chosen ? chosen->data() : nullptr;
  if (row)
    size = static_cast<std::size_t>(chosen->size());
  py::array_t<double> array({size, width});
  double* out = array.mutable_data();
  for (std::size_t k = 0; k < width; ++k)
    for (std::size_t p = 0; p < size; ++p)
      out[p * width + k] = columns[k][row ? static_cast<std::size_t>(row[p]) : p];
  return array;
}

/// Columns from rows of numbers.
inline void set_rows(std::span<const double> in, std::span<Column> columns)
{
  for (std::size_t k = 0; k < columns.size(); ++k)
    for (std::size_t p = 0; p < columns[k].size(); ++p)
      columns[k][p] = in[p * columns.size() + k];
}

/// Calls f(field, columns) for the field of that name.
/// @returns whether there is one
template <class P, class F>
bool with_field(P& particles, const std::string& name, F&& f)
{
  bool found = false;
  for_each_field(particles,
                 [&](const Field& field, auto& columns)
                 {
                   if (field.name != name)
                     return;
                   found = true;
                   f(field, columns);
                 });
  return found;
}

/// Whether a field is one number for each particle, shape (n,), and not several, (n, k). State variables are rows,
/// however many there are.
template <class Columns>
bool is_scalar(const Field& field, const Columns& columns)
{
  if constexpr (std::is_same_v<Columns, std::vector<Column>>)
    return columns.size() == 1 && field.name != "state";
  else if constexpr (is_optional<Columns>)
    return columns.columns.size() == 1;
  else
    return std::is_same_v<Columns, OptionalColumns<1>> ||
           std::is_same_v<std::remove_cvref_t<decltype(columns_of(columns)[0])>, Columns>;
}

/// A copy of a field, of all particles or of the chosen ones.
/// @throws InputError for a field that does not exist, or a row that is not there
template <class G, int D = G::dim>
py::object column(const Model<G>& model, const std::string& name, const ChosenRows& chosen)
{
  const Particles<D>& particles = model.particles;
  const std::size_t n = particles.id.size();
  if (chosen)
    require_rows(*chosen, n);
  py::object copy;
  const auto copy_field = [&](const Field& field, const auto& columns)
  {
    const auto all = columns_of(columns);
    if (is_scalar(field, columns))
      copy = chosen_of(all[0], is_present(columns) ? chosen : ChosenRows{});
    else if constexpr (std::is_same_v<const Column&, decltype(all[0])>)
      copy = is_present(columns) ? rows(all, n, chosen) : rows(all, 0, {});
  };
  if (!with_field(particles, name, copy_field))
    throw InputError("particle field is '" + name + "', which does not exist");
  return copy;
}

/// Copies of fields by name, real ones in single or double precision, column by column; the position is always there.
/// @param padded  the two components of a vector become rows of three, as files store them
/// @throws InputError for a field that does not exist, or that no particle carries
template <class G, int D = G::dim>
py::dict copied_fields(const Model<G>& model, const std::vector<std::string>& names, bool single, bool padded)
{
  py::dict copies;
  for_each_view(model.particles, names,
                [&](const std::string& name, const auto& view)
                {
                  const auto copied = [&]<class T>(const FieldView& field, T)
                  {
                    const bool is_vector = field.components.size() == 2 && name != "state";
                    return padded && is_vector ? padded_field<T>(field) : copied_field<T>(field, true);
                  };
                  if constexpr (std::is_same_v<std::remove_cvref_t<decltype(view)>, IndexView>)
                    copies[py::str(name)] = copied_field(view);
                  else if (single)
                    copies[py::str(name)] = copied(view, float{});
                  else
                    copies[py::str(name)] = copied(view, double{});
                });
  return copies;
}

/// Notes that the particles are no longer as a step left them: moments are to be summed again, and the energy balance
/// begins anew.
template <class G>
void changed(Model<G>& model)
{
  model.ready = false;
  model.energy.stale = true;
}

/// @throws InputError for a field that cannot be set, or another shape
template <class G, int D = G::dim>
void set_column(Model<G>& model, const std::string& name, const py::array& array)
{
  Particles<D>& particles = model.particles;
  const std::size_t n = particles.id.size();
  bool is_set = false;
  const auto set_field = [&](const Field& field, auto& columns)
  {
    using Columns = std::remove_cvref_t<decltype(columns)>;
    if constexpr (std::is_same_v<typename decltype(columns_of(columns))::value_type, Column>)
    {
      if (!field.settable)
        return;
      const bool is_one = is_scalar(field, columns);
      if (is_one)
        check_array<double>(name.c_str(), array, {static_cast<py::ssize_t>(n)});
      else
        check_array<double>(name.c_str(), array,
                            {static_cast<py::ssize_t>(n), static_cast<py::ssize_t>(columns_of(columns).size())});
      if constexpr (is_optional<Columns>)
        require(columns, n, field.initial);
      set_rows(values<double>(array), columns_of(columns));
      if (field.name == "velocity" && !particles.resting.present)
        particles.velocity_gradient = {}; // those of the velocities that were there
      is_set = true;
    }
  };
  with_field(particles, name, set_field);
  if (!is_set)
    throw InputError("particle field is '" + name + "', which cannot be set");
  if (has_two_phases(model) && (name == "pore_pressure" || name == "porosity"))
    fill_pores(model); // from whose mass the pressure follows in steps
  changed(model);
}

/// An entry of a schedule of fields, for Python.
inline py::dict described(const Field& field, std::size_t components, bool optional)
{
  using namespace py::literals;
  return py::dict("name"_a = field.name, "unit"_a = field.unit, "meaning"_a = field.meaning,
                  "components"_a = components, "initial"_a = field.initial, "optional"_a = optional,
                  "settable"_a = field.settable);
}

/// The schedule of a model's particle fields.
template <int D>
py::list particle_schedule(const Particles<D>& particles)
{
  py::list entries;
  for_each_field(particles,
                 [&](const Field& field, const auto& columns) {
                   entries.append(described(field, columns_of(columns).size(),
                                            is_optional<std::remove_cvref_t<decltype(columns)>>));
                 });
  return entries;
}
} // namespace mpm::python
