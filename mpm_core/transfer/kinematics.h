#pragma once
/// @file
/// From nodes to particles: motion and strain. Consistent: a nodal field that is affine arrives exactly.

#include "transfer/cell_strain.h"
#include "transfer/moments.h"

namespace mpm::transfer
{
/// Moves the particles [first, last) of a cell: v_p = flip_fraction v_p + sum N_i change_i (18),
/// x_p += sum N_i displacement_i (20).
/// @returns whether each particle is still inside of the cell (and finite)
template <int D>
bool move_particles(Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                    const CellMotion<D>& motion);

/// Counts the displacement of the particles [first, last) of a cell, which stay where they are: sum N_i displacement_i.
template <int D>
void count_displacement(Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                        const CellMotion<D>& motion);

/// Columns of a symmetric tensor in the order of `symmetric_pairs`: the stress without zz in plane strain.
template <int D>
using SymmetricColumns = std::array<double*, n_symmetric<D>>;

/// R sigma R^T for the entries [first, last) of stress columns, in place.
template <int D>
void rotate(const SymmetricColumns<D>& stress, Index first, Index last, const Matrix<D>& rotation);

/// Columns that a strain changes: stresses without zz in plane strain, volume, deviatoric strain.
template <int D>
inline std::array<double*, n_symmetric<D> + 2> strain_columns(Particles<D>& particles)
{
  std::array<double*, n_symmetric<D> + 2> columns;
  for (int k = 0; k < n_symmetric<D>; ++k)
    columns[k] = particles.stress[stress_component<D>[k]].data();
  columns[n_symmetric<D>] = particles.volume.data();
  columns[n_symmetric<D> + 1] = particles.deviatoric_strain.data();
  return columns;
}

/// Rotates the stresses of the particles [first, last), grows their volumes and accumulates their deviatoric strain.
template <int D>
void strain_particles(Particles<D>& particles, Index first, Index last, const CellStrain<D>& strain);
} // namespace mpm::transfer
