#pragma once
/// @file
/// Particles as a structure of arrays, and the one list of their fields.

#include "base/types.h"

#include <span>

namespace mpm
{
/// Contiguous particles [first, last) that lie in one cell and are of one material.
struct Run
{
  Index first;
  Index last;
  Index cell;
  Index material;
  bool first_in_cell = false; ///< whether it is the first one in its cell
  bool scattered = false;     ///< whether some of its particles are in another cell by now
};

/// All columns have one entry per particle, but for `traction`, which is empty unless `loaded`.
template <int D>
struct Particles
{
  std::vector<GlobalIndex> id;            ///< unique over all ranks, never changes
  std::array<Column, D> position;         ///< [m]
  std::array<Column, D> velocity;         ///< [m/s]
  std::array<Column, n_stress<D>> stress; ///< Cauchy stress [Pa]
  Column volume;                          ///< [m^D]; per metre of thickness in plane strain
  Column mass;                            ///< [kg], [kg/m] in plane strain
  Column deviatoric_strain;               ///< accumulated deviatoric strain, sum of sqrt(2/3 de : de)
  std::vector<Column> state; ///< state variables of the law; 0 is the accumulated plastic deviatoric strain
  std::array<Column, D> initial_position; ///< [m]; displacement is position minus this
  bool loaded = false;                    ///< whether there are tractions; a rank without particles must know it too
  std::array<Column, D> traction;         ///< force from a loaded boundary, t_p of (15) [N], moves with the particle
  std::vector<Index> material;            ///< number of the law
  std::vector<Index> cell;                ///< cell on this rank that holds the particle

  Index size() const { return static_cast<Index>(id.size()); }
};

/// The one list of fields: calls f(name, component, column) for every column. Sorting, migration, checkpoints and
/// output iterate this list, so a field that is added here is everywhere.
/// @note A column of an optional field may be empty.
template <class P, class F>
void for_each_column(P& particles, F&& f)
{
  auto components = [&f](const char* name, auto& columns)
  {
    for (std::size_t i = 0; i < columns.size(); ++i)
      f(name, static_cast<int>(i), columns[i]);
  };
  f("id", 0, particles.id);
  components("position", particles.position);
  components("velocity", particles.velocity);
  components("stress", particles.stress);
  f("volume", 0, particles.volume);
  f("mass", 0, particles.mass);
  f("deviatoric_strain", 0, particles.deviatoric_strain);
  components("state", particles.state);
  components("initial_position", particles.initial_position);
  components("traction", particles.traction);
  f("material", 0, particles.material);
  f("cell", 0, particles.cell);
}

/// Changes the number of particles; new ones are zero. Optional columns stay empty where they are.
template <int D>
void resize(Particles<D>& particles, Index size);

/// Makes the optional traction columns, zero, where they are not there yet.
template <int D>
void require_traction(Particles<D>& particles);

template <int D>
inline Vector<D> at(const std::array<Column, D>& columns, Index p)
{
  Vector<D> v;
  for (int i = 0; i < D; ++i)
    v[i] = columns[i][p];
  return v;
}

/// Puts particle `order[p]` in place p.
template <int D>
void reorder(Particles<D>& particles, std::span<const Index> order);

/// Puts the particles in the order of their cells (then of their material), by a stable counting sort.
template <int D>
void sort_by_cell(Particles<D>& particles, Index n_cells, Index n_materials);

/// Takes particles out; the last ones fill the holes. @pre `numbers` is sorted and without repetition
template <int D>
void remove(Particles<D>& particles, std::span<const Index> numbers);

/// The runs in which the particles lie, none longer than `longest`. Fewest when the particles are in cell order. Marks
/// of runs are false.
template <int D>
void find_runs(const Particles<D>& particles, Index longest, std::vector<Run>& runs);

/// The same after no particles have changed cells but some of runs that are marked as scattered.
template <int D>
void find_runs_again(const Particles<D>& particles, Index longest, std::vector<Run>& runs);

/// Bytes that the columns hold per particle
template <int D>
double bytes_per_particle(const Particles<D>& particles);
} // namespace mpm
