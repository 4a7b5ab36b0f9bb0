#pragma once
/// @file
/// What the content of a checkpoint must be, whoever wrote it; a wrong one is noted in the file and raised by its
/// `check`.

#include "base/table.h"
#include "io/hdf5_input.h"
#include "parallel/migration.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace mpm::io
{
/// Whole numbers below it are exact in double precision; a run counts no further.
inline constexpr double most_exact = 9007199254740992.0;
/// No total comes near it, and a whole number of 64 bits holds it.
inline constexpr double most_total = 9e18;

/// Of the height of a cell, how far outside of it a particle may lie; far more than the search for cells allows.
inline constexpr double most_outside = 1e-6;

/// This rank's rows of an array of which each rank of the file wrote some, on as many ranks as now.
/// @param array  any of those that have these rows
inline RowSlice own_rows(Hdf5Input& file, MPI_Comm comm, const std::string& name, const std::string& array)
{
  int rank = 0, size = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &size);
  auto counts = file.read<std::int64_t>("/ranks/rows_of_" + name, {0, size, 0}, 1);
  counts.resize(static_cast<std::size_t>(size));
  const GlobalIndex total = file.shape(array).first;
  GlobalIndex sum = 0;
  for (auto& count : counts)
  {
    if (count < 0 || count > total - sum)
    {
      file.reject("/ranks/rows_of_" + name,
                  std::to_string(count) + " rows of " + std::to_string(total) + " in " + array);
      count = 0;
    }
    sum += count;
  }
  if (sum != total)
    file.reject("/ranks/rows_of_" + name,
                std::to_string(sum) + " rows in all, " + array + " has " + std::to_string(total));
  RowSlice rows;
  for (int r = 0; r < rank; ++r)
    rows.before += counts[static_cast<std::size_t>(r)];
  rows.local = counts[static_cast<std::size_t>(rank)];
  return rows;
}

/// Refuses values that no run writes.
inline void check_values(Hdf5Input& file, const std::string& name, std::span<const double> values)
{
  const bool is_positive = name == "mass" || name == "volume";
  for (double value : values)
    if (!std::isfinite(value) || (is_positive && !(value > 0)))
      return file.reject("/particles/" + name, "it has the value " + std::to_string(value));
}

inline void check_materials(Hdf5Input& file, std::span<const std::int64_t> values, std::size_t materials)
{
  for (std::int64_t value : values)
    if (value < 0 || static_cast<std::size_t>(value) >= materials)
      return file.reject("/particles/material", "it has the number " + std::to_string(value) + ", but there are " +
                                                    std::to_string(materials) + " materials");
}

/// Refuses rows of cells that this rank does not own, and numbers that no run writes.
template <int D>
void check_cells(Hdf5Input& file, const Mesh<D>& mesh, const Table& table)
{
  const auto numbers = owned_cell_numbers(mesh);
  const auto width = static_cast<std::size_t>(table.width);
  for (std::size_t k = 0; k < table.values.size(); ++k)
  {
    const double value = table.values[k];
    const bool is_cell = k % width == 0;
    if (!std::isfinite(value) ||
        (is_cell && (!(std::abs(value) < most_exact) || !numbers.contains(static_cast<GlobalIndex>(value)))))
      return file.reject("/cells/" + table.name, std::string("it has the ") + (is_cell ? "cell " : "value ") +
                                                     std::to_string(value) + (is_cell ? ", which is not there" : ""));
  }
}

/// Refuses particles that are not in their cells, but for round-off.
template <int D>
void check_positions(Hdf5Input& file, const Mesh<D>& mesh, const Particles<D>& particles)
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
    return file.reject("/particles/position", "it has the place " + place + "), which is not in that particle's cell " +
                                                  std::to_string(mesh.global_cells[cell]));
  }
}

/// Refuses totals that no run writes.
inline void check_totals(Hdf5Input& file, const Table& table, std::size_t rows)
{
  if (table.values.size() != rows * static_cast<std::size_t>(table.width))
    return file.reject("/ranks/" + table.name, "it is too short");
  const double most = std::min(table.most_count, most_exact);
  const auto is_count = [most](double value) { return value >= 0 && value <= most && value == std::floor(value); };
  const auto is_total = [&table](double value)
  { return std::abs(value) < most_total || (table.may_be_unknown && std::isnan(value)); };
  for (double value : table.values)
    if (table.most_count > 0 ? !is_count(value) : !is_total(value))
      return file.reject("/ranks/" + table.name, "it has the value " + std::to_string(value));
}

/// Number of rows of an array, if this rank's indices can count them.
inline GlobalIndex countable_rows(Hdf5Input& file, const std::string& name)
{
  const GlobalIndex rows = file.shape(name).first;
  if (rows > std::numeric_limits<Index>::max())
    file.reject(name, "it has " + std::to_string(rows) + " rows");
  file.check();
  return rows;
}
} // namespace mpm::io
