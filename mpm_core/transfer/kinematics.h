#pragma once
/// @file
/// From nodes to particles: motion and strain. Consistent: a nodal field that is affine arrives exactly.

#include "transfer/cell_strain.h"
#include "transfer/moments.h"

#include <span>

namespace mpm
{
/// What a node does to the particles over a step: change of velocity [m/s], then displacement [m]. Together, since both
/// are wanted at once at the nodes of a cell.
template <int D>
using NodalMotion = std::array<double, 2 * D>;

/// Moves the particles of a run: v_p = keep v_p + sum N_i change_i (18), x_p += sum N_i displacement_i (20).
/// @param motion  per node
/// @param keep    share of its velocity that a particle keeps, 1 in FLIP
/// @returns number of particles that are no longer inside of the run's cell (or not finite)
template <int D>
int move_particles(Particles<D>& particles, const Run& run, const Mesh<D>& mesh, std::span<const NodalMotion<D>> motion,
                   double keep);

/// Columns of a symmetric tensor in the order of `symmetric_pairs`: the stress without zz in plane strain.
template <int D>
using SymmetricColumns = std::array<double*, n_symmetric<D>>;

/// R sigma R^T for the entries [first, last) of stress columns, in place.
template <int D>
void rotate(const SymmetricColumns<D>& stress, Index first, Index last, const Matrix<D>& rotation);

/// Rotates the stresses of the particles [first, last), grows their volumes and accumulates their deviatoric strain.
template <int D>
void strain_particles(Particles<D>& particles, Index first, Index last, const CellStrain<D>& strain);
} // namespace mpm
