#pragma once
/// @file
/// Particles as a structure of arrays, and the one schedule of their fields.

#include "particles/field.h"

#include <span>

namespace mpm::particles
{
/// Contiguous particles [first, last) that lie in one cell and are of one material.
struct Run
{
  Index first;
  Index last;
  Index cell;
  Index material;
  bool first_in_cell = false; ///< whether it is the first one in its cell
  bool out_of_order = false;  ///< whether some of its particles are in another cell by now
  bool resting = false;       ///< whether it is the one row of a resting cell
};

/// All columns have one entry per particle; those of optional fields may be absent. A resting cell has one entry, too:
/// its centre stands for all its particles, which do not move relative to the cell (model/resting.h).
template <int D>
struct Particles
{
  std::vector<GlobalIndex> id;
  std::array<Column, D> position;
  std::array<Column, D> velocity;
  std::array<Column, n_stress<D>> stress;
  Column volume;
  Column mass;
  Column deviatoric_strain;
  std::vector<Column> state;
  std::array<Column, D> initial_position;
  OptionalColumns<D> traction;
  OptionalColumns<1> resting;
  OptionalColumns<D * D> velocity_gradient;
  OptionalColumns<D> resting_displacement;
  OptionalColumns<D * D> displacement_gradient;
  OptionalColumns<1> pore_pressure, porosity, conductivity; ///< of water in the soil
  OptionalColumns<1> saturation;                            ///< where soil may dry
  OptionalColumns<D> pressure_gradient;
  OptionalColumns<D> water_velocity; ///< of water that moves by itself; `mass` is then that of the grains
  OptionalColumns<1> water_mass;
  OptionalColumns<D * D> water_gradient; ///< of its velocity, in resting cells
  std::vector<Index> material;
  std::vector<Index> cell;
  std::vector<AddedField> added; ///< fields that the run has declared for itself

  Index size() const { return static_cast<Index>(id.size()); }
};

/// The one schedule of fields: calls f(field, columns) for every field. Sorting, migration, checkpoints, files, Python
/// and its documentation follow it, so a field that is entered here, beside its columns above, is everywhere.
template <class P, class F>
void for_each_field(P& particles, F&& f)
{
  constexpr bool settable = true;
  f(Field{"id", "-", "Number, unique over all ranks, which never changes"}, particles.id);
  f(Field{"position", "m", "Position"}, particles.position);
  f(Field{"velocity", "m/s", "Velocity", settable}, particles.velocity);
  f(Field{"stress", "Pa", "Cauchy stress, tension positive", settable}, particles.stress);
  f(Field{"volume", "m^D", "Volume, per metre of thickness in plane strain", settable}, particles.volume);
  f(Field{"mass", "kg",
          "Mass, per metre of thickness in plane strain; of the grains alone where water has its own velocity",
          settable},
    particles.mass);
  f(Field{"deviatoric_strain", "-", "Accumulated deviatoric strain, sum of sqrt(2/3 de : de)", settable},
    particles.deviatoric_strain);
  f(Field{"state", "as the law says",
          "State variables of the law; the first is the accumulated plastic deviatoric strain", settable},
    particles.state);
  f(Field{"initial_position", "m", "Position from which displacement counts", settable}, particles.initial_position);
  f(Field{"traction", "N", "Force from a loaded boundary, t_p of (15), which moves with the particle", settable},
    particles.traction);
  f(Field{"resting", "-", "Number of particles that a resting cell stands for; 0 in a particle"}, particles.resting);
  f(Field{"velocity_gradient", "1/s",
          "Gradient of the velocity in a resting cell, and of particles with affine transfer; dv_x/dx first, then "
          "dv_x/dy",
          settable},
    particles.velocity_gradient);
  f(Field{"resting_displacement", "m", "Displacement of the centre of a resting cell since it began to rest"},
    particles.resting_displacement);
  f(Field{"displacement_gradient", "-", "Gradient of the displacement in a resting cell since it began to rest"},
    particles.displacement_gradient);
  f(Field{"pore_pressure", "Pa", "Pressure of the pore water, compression positive", settable},
    particles.pore_pressure);
  f(Field{"pressure_gradient", "Pa/m", "Gradient of the pore pressure", settable}, particles.pressure_gradient);
  f(Field{"porosity", "-", "Volume of the pores over that of the soil", settable}, particles.porosity);
  f(Field{"conductivity", "m/s", "Hydraulic conductivity", settable}, particles.conductivity);
  f(Field{"saturation", "-",
          "Degree of saturation where soil may dry, which follows from the pore pressure, or of moist soil", settable,
          1},
    particles.saturation);
  f(Field{"water_velocity", "m/s", "Velocity of the pore water where it has its own, in explicit runs", settable},
    particles.water_velocity);
  f(Field{"water_mass", "kg", "Mass of the pore water where it has its own velocity, per metre in plane strain"},
    particles.water_mass);
  f(Field{"water_gradient", "1/s",
          "Gradient of the velocity of the pore water in a resting cell, where it has its own; dw_x/dx first, then "
          "dw_x/dy",
          settable},
    particles.water_gradient);
  f(Field{"material", "-", "Number of the law"}, particles.material);
  f(Field{"cell", "-", "Number of the cell on this rank that holds the particle"}, particles.cell);
  for (auto& added : particles.added)
    f(added.field(), added.columns);
}

/// Calls f(name, component, column) for every column of every field.
/// @note The columns of an optional field may be empty.
template <class P, class F>
void for_each_column(P& particles, F&& f)
{
  for_each_field(particles,
                 [&f](const Field& field, auto& columns)
                 {
                   int component = 0;
                   for (auto& column : columns_of(columns))
                     f(field.name, component++, column);
                 });
}

/// Declares a field of the run's own, with its initial value in all particles there are.
/// @throws InputError a name that another field has, or that is no word; no components
template <int D>
void add_field(Particles<D>& particles, AddedField field, int components);

/// Particles with the same fields, and none of them there.
template <int D>
Particles<D> empty_like(const Particles<D>& particles);

/// Changes the number of particles; new ones have the initial values. Optional fields that are absent stay so.
template <int D>
void resize(Particles<D>& particles, Index size);

/// Makes the columns of an optional field, with its initial value, where they are not there yet.
template <std::size_t N>
void require(OptionalColumns<N>& field, std::size_t size, double initial = 0)
{
  field.present = true;
  for (Column& column : field.columns)
    column.resize(size, initial);
}

template <int D>
inline Vector<D> at(const std::array<Column, D>& columns, Index p)
{
  Vector<D> v;
  for (int i = 0; i < D; ++i)
    v[i] = columns[i][p];
  return v;
}

/// Whether a row is that of a resting cell.
template <int D>
inline bool is_resting(const Particles<D>& particles, Index p)
{
  return particles.resting.present && particles.resting[0][p] > 0;
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

/// The runs in which the particles lie, none longer than `longest`; the row of a resting cell is one. Fewest when the
/// particles are in cell order. Marks of order are false.
template <int D>
void find_runs(const Particles<D>& particles, Index longest, std::vector<Run>& runs);

/// The same after no particles have changed cells but some of runs that are marked as out of order.
template <int D>
void find_runs_again(const Particles<D>& particles, Index longest, std::vector<Run>& runs);

/// Bytes that the columns hold per particle
template <int D>
double bytes_per_particle(const Particles<D>& particles);
} // namespace mpm::particles
