#pragma once
/// @file
/// What the content of a checkpoint must be, whoever wrote it.

#include "base/table.h"
#include "parallel/migration.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace mpm::python
{
/// Whole numbers below it are exact in double precision; a run counts no further.
inline constexpr double most_exact = 9007199254740992.0;
/// No total comes near it, and a whole number of 64 bits holds it.
inline constexpr double most_total = 9e18;

/// No value of a particle comes near it, and its square is finite.
inline constexpr double most_value = 1e100;

/// Largest distance of a particle outside of its cell, over the cell's height; far more than the search for cells
/// allows.
inline constexpr double most_outside = 1e-6;

/// What is wrong with the content of a file on this rank; the first finding counts.
struct Refusal
{
  std::string array; ///< empty if nothing is wrong
  std::string reason;

  void note(const std::string& name, const std::string& why)
  {
    if (array.empty())
      array = name, reason = why;
  }
  std::string text(const std::string& path) const
  {
    return array.empty() ? "" : "cannot read " + array + " in " + path + ": " + reason;
  }
};

/// Refuses values that no run writes.
inline void check_values(Refusal& refusal, const std::string& name, std::span<const double> values)
{
  const bool is_positive = name == "mass" || name == "volume";
  for (double value : values)
    if (!(std::abs(value) < most_value) || (is_positive && !(value > 0)))
      return refusal.note("/particles/" + name, "it has the value " + std::to_string(value) + ", expected " +
                                                    (is_positive ? "numbers above 0" : "finite numbers"));
}

inline void check_materials(Refusal& refusal, std::span<const std::int64_t> values, std::size_t materials)
{
  for (std::int64_t value : values)
    if (value < 0 || static_cast<std::size_t>(value) >= materials)
      return refusal.note("/particles/material", "it has the number " + std::to_string(value) + ", but there are " +
                                                     std::to_string(materials) + " materials");
}

/// Refuses rows of cells that this rank does not own, and numbers that no run writes.
template <int D>
void check_cells(Refusal& refusal, const Mesh<D>& mesh, const Table& table)
{
  const auto numbers = owned_cell_numbers(mesh);
  const auto width = static_cast<std::size_t>(table.width);
  for (std::size_t k = 0; k < table.values.size(); ++k)
  {
    const double value = table.values[k];
    const bool is_cell = k % width == 0;
    if (!std::isfinite(value) ||
        (is_cell && (!(std::abs(value) < most_exact) || !numbers.contains(static_cast<GlobalIndex>(value)))))
      return refusal.note("/cells/" + table.name, std::string("it has the ") + (is_cell ? "cell " : "value ") +
                                                      std::to_string(value) + (is_cell ? ", which is not there" : ""));
  }
}

/// Refuses particles that are not in their cells, but for round-off.
template <int D>
void check_positions(Refusal& refusal, const Mesh<D>& mesh, const Particles<D>& particles)
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
    return refusal.note("/particles/position", "it has the place " + place +
                                                   "), which is not in that particle's cell " +
                                                   std::to_string(mesh.global_cells[cell]));
  }
}

/// Refuses totals that no run writes.
inline void check_totals(Refusal& refusal, const Table& table)
{
  const double most = std::min(table.most_count, most_exact);
  const auto is_count = [most](double value) { return value >= 0 && value <= most && value == std::floor(value); };
  const auto is_total = [&table](double value)
  {
    return (std::abs(value) < most_total && (value >= 0 || !table.is_positive)) ||
           (table.may_be_unknown && std::isnan(value));
  };
  const std::string expected = table.most_count > 0 ? "a whole number from 0 to " + std::to_string(most)
                               : table.is_positive  ? "a number from 0 on"
                                                    : "a finite number";
  for (double value : table.values)
    if (table.most_count > 0 ? !is_count(value) : !is_total(value))
      return refusal.note("/ranks/" + table.name,
                          "it has the value " + std::to_string(value) + ", expected " + expected);
}
} // namespace mpm::python
