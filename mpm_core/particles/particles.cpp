#include "particles/particles.h"

#include <algorithm>
#include <cctype>
#include <tuple>
#include <utility>

namespace mpm::particles
{
template <int D>
void add_field(Particles<D>& particles, AddedField field, int components)
{
  const bool is_word =
      !field.name.empty() && std::ranges::all_of(field.name, [](char c) { return std::isalnum(c) || c == '_'; });
  if (!is_word)
    throw InputError("name of the field is '" + field.name + "', expected letters, digits and _");
  if (components < 1)
    throw InputError("components of the field " + field.name + " are " + std::to_string(components) +
                     ", expected 1 or more");
  for_each_field(particles,
                 [&](const Field& known, const auto&)
                 {
                   if (known.name == field.name)
                     throw InputError("name of the field is '" + field.name + "', which another field has");
                 });
  field.columns.assign(static_cast<std::size_t>(components), Column(particles.id.size(), field.initial));
  particles.added.push_back(std::move(field));
}

template <int D>
Particles<D> empty_like(const Particles<D>& particles)
{
  Particles<D> empty;
  empty.state.resize(particles.state.size());
  for (const AddedField& field : particles.added)
    empty.added.push_back(
        {field.name, field.unit, field.meaning, field.initial, std::vector<Column>(field.columns.size())});
  return empty;
}

template <int D>
void resize(Particles<D>& particles, Index size)
{
  for_each_field(particles,
                 [n = static_cast<std::size_t>(size)](const Field& field, auto& columns)
                 {
                   if (!is_present(columns))
                     return;
                   for (auto& column : columns_of(columns))
                     column.resize(n, static_cast<std::remove_cvref_t<decltype(column[0])>>(field.initial));
                 });
}

template <int D>
void reorder(Particles<D>& particles, std::span<const Index> order)
{
  // One column of each type is the scratch of the next: memory that is new costs more than the copies.
  std::tuple<Column, std::vector<Index>, std::vector<GlobalIndex>> scratch;
  for_each_column(particles,
                  [order, &scratch](std::string_view, int, auto& column)
                  {
                    if (column.empty())
                      return;
                    auto& sorted = std::get<std::remove_reference_t<decltype(column)>>(scratch);
                    sorted.resize(column.size());
                    for (std::size_t p = 0; p < sorted.size(); ++p)
                      sorted[p] = column[static_cast<std::size_t>(order[p])];
                    column.swap(sorted);
                  });
}

template <int D>
void sort_by_cell(Particles<D>& particles, Index n_cells, Index n_materials)
{
  const std::size_t n = particles.id.size();
  auto key = [&](std::size_t p)
  {
    return static_cast<std::size_t>(particles.cell[p]) * static_cast<std::size_t>(n_materials) +
           static_cast<std::size_t>(n_materials > 1 ? particles.material[p] : 0);
  };
  std::vector<Index> start(static_cast<std::size_t>(n_cells) * static_cast<std::size_t>(n_materials) + 1, 0);
  for (std::size_t p = 0; p < n; ++p)
    ++start[key(p) + 1];
  for (std::size_t k = 1; k < start.size(); ++k)
    start[k] += start[k - 1];
  std::vector<Index> order(n);
  for (std::size_t p = 0; p < n; ++p)
    order[static_cast<std::size_t>(start[key(p)]++)] = static_cast<Index>(p);

  reorder<D>(particles, order);
}

template <int D>
void remove(Particles<D>& particles, std::span<const Index> numbers)
{
  auto last = particles.id.size();
  for (std::size_t k = numbers.size(); k-- > 0;)
  {
    --last;
    const auto hole = static_cast<std::size_t>(numbers[k]);
    for_each_column(particles,
                    [hole, last](std::string_view, int, auto& column)
                    {
                      if (!column.empty())
                        column[hole] = column[last];
                    });
  }
  resize(particles, static_cast<Index>(last));
}

namespace
{
/// Appends particles of one cell and material; they join the run before as far as it may grow.
void append(std::vector<Run>& runs, Run piece, Index longest)
{
  if (!runs.empty() && runs.back().cell == piece.cell && runs.back().material == piece.material &&
      runs.back().last == piece.first && !runs.back().resting && !piece.resting)
  {
    const Index joining = std::min(piece.last - piece.first, longest - (runs.back().last - runs.back().first));
    runs.back().last += joining;
    piece.first += joining;
  }
  for (; piece.first < piece.last; piece.first += longest)
    runs.push_back({.first = piece.first,
                    .last = std::min(piece.last, piece.first + longest),
                    .cell = piece.cell,
                    .material = piece.material,
                    .resting = piece.resting});
}

template <int D>
void append_one_by_one(const Particles<D>& particles, Index first, Index last, Index longest, std::vector<Run>& runs)
{
  for (Index p = first; p < last;)
  {
    const Index cell = particles.cell[p], material = particles.material[p];
    const bool resting = is_resting(particles, p);
    Index q = p + 1;
    while (!resting && q < last && particles.cell[q] == cell && particles.material[q] == material &&
           !is_resting(particles, q))
      ++q;
    append(runs, {.first = p, .last = q, .cell = cell, .material = material, .resting = resting}, longest);
    p = q;
  }
}
} // namespace

template <int D>
void find_runs(const Particles<D>& particles, Index longest, std::vector<Run>& runs)
{
  runs.clear();
  append_one_by_one(particles, 0, particles.size(), longest, runs);
}

template <int D>
void find_runs_again(const Particles<D>& particles, Index longest, std::vector<Run>& runs)
{
  std::vector<Run> found;
  found.reserve(runs.size() + runs.size() / 8);
  for (const Run& run : runs)
    if (run.out_of_order)
      append_one_by_one(particles, run.first, run.last, longest, found);
    else
      append(found, run, longest);
  runs.swap(found);
}

template <int D>
double bytes_per_particle(const Particles<D>& particles)
{
  double bytes = 0;
  for_each_column(particles, [&bytes](std::string_view, int, const auto& column)
                  { bytes += static_cast<double>(column.size() * sizeof(column[0])); });
  return particles.size() == 0 ? 0 : bytes / particles.size();
}

#define INSTANTIATE(D)                                                                                                 \
  template void resize(Particles<D>&, Index);                                                                          \
  template void add_field(Particles<D>&, AddedField, int);                                                             \
  template Particles<D> empty_like(const Particles<D>&);                                                               \
  template void reorder(Particles<D>&, std::span<const Index>);                                                        \
  template void sort_by_cell(Particles<D>&, Index, Index);                                                             \
  template void remove(Particles<D>&, std::span<const Index>);                                                         \
  template void find_runs(const Particles<D>&, Index, std::vector<Run>&);                                              \
  template void find_runs_again(const Particles<D>&, Index, std::vector<Run>&);                                        \
  template double bytes_per_particle(const Particles<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::particles
