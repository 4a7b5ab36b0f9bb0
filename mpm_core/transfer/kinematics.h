#pragma once
/// @file
/// From nodes to particles: motion and strain. Consistent: a nodal field that is affine arrives exactly.

#include "transfer/moments.h"

#include <span>

namespace mpm
{
/// The nodal fields that move the particles.
template <int D>
struct NodalMotion
{
  const Mesh<D>& mesh;
  std::span<const Vector<D>> start_velocity; ///< v_i at the step's start, used only by a PIC share
  std::span<const Vector<D>> acceleration;   ///< a_i
  std::span<const Vector<D>> velocity;       ///< v_i that carries the particles over the step
};

/// Moves the particles of a run: v_p += dt sum N_i a_i (18), x_p += dt sum N_i v_i (20). With a PIC share, that share of v_p is
/// replaced by the grid's velocity sum N_i (v_i + dt a_i).
/// @returns number of particles that are no longer inside of the run's cell (or not finite)
template <int D>
int move_particles(Particles<D>& particles, const Run& run, const NodalMotion<D>& motion, double dt, double pic_share);

/// Strain increment of one cell and the rotation that goes with it.
template <int D>
struct CellStrain
{
  SymTensor<D> increment; ///< engineering shear
  double volumetric;      ///< trace of the increment
  double deviatoric;      ///< sqrt(2/3 de : de)
  Matrix<D> rotation;     ///< of the material over the step, orthogonal
};

/// From the gradient of velocity over a step. The rotation is the Cayley transform of the spin (Hughes & Winget 1980), so
/// that stresses turn without a change of size however large the step.
template <int D>
CellStrain<D> strain_increment(const Matrix<D>& velocity_gradient, double dt);

/// Replaces the volumetric part: d is 2 in plane strain, where it is spread over the in-plane components, so that
/// the strain out of plane stays zero; 3 in three dimensions.
template <int D>
void set_volumetric(CellStrain<D>& strain, double volumetric);

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
