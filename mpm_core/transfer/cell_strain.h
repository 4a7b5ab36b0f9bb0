#pragma once
/// @file
/// The strain increment that a cell's particles share; for one cell, T = double, or for several at once, T = Lanes.

#include "base/geometry.h"
#include "base/lanes.h"

namespace mpm::transfer
{
/// Strain increment of a cell and the rotation that goes with it.
template <int D, class T = double>
struct CellStrain
{
  std::array<T, n_stress<D>> increment;     ///< engineering shear
  T volumetric;                             ///< trace of the increment
  T deviatoric;                             ///< sqrt(2/3 de : de)
  std::array<std::array<T, D>, D> rotation; ///< of the material over the step, orthogonal
};

/// sqrt(2/3 e : e) of the deviatoric part of a strain
template <int D, class T>
inline T deviatoric_size(const std::array<T, n_stress<D>>& e, const T& volumetric)
{
  T normal{}, shear{};
  for (int k = 0; k < 3; ++k)
    normal += (e[k] - volumetric / 3) * (e[k] - volumetric / 3);
  for (int k = 3; k < n_stress<D>; ++k)
    shear += e[k] * e[k];
  return root(2.0 / 3.0 * (normal + 0.5 * shear));
}

/// From the gradient of velocity over a step. Stresses turn by the Cayley transform of the spin without a change of
/// size.
template <int D, class T>
inline CellStrain<D, T> strain_increment(const std::array<std::array<T, D>, D>& velocity_gradient, double dt)
{
  CellStrain<D, T> strain{};
  std::array<std::array<T, D>, D> half_spin;
  for (int i = 0; i < D; ++i)
  {
    strain.increment[i] = dt * velocity_gradient[i][i];
    strain.volumetric += strain.increment[i];
    for (int j = 0; j < D; ++j)
      half_spin[i][j] = 0.25 * dt * (velocity_gradient[i][j] - velocity_gradient[j][i]);
  }
  for (int k = D; k < n_symmetric<D>; ++k)
  {
    const auto [i, j] = symmetric_pairs<D>[k];
    strain.increment[stress_component<D>[k]] = dt * (velocity_gradient[i][j] + velocity_gradient[j][i]);
  }
  strain.deviatoric = deviatoric_size<D>(strain.increment, strain.volumetric);
  strain.rotation = cayley_rotation<D>(half_spin);
  return strain;
}

/// Adds the strain of rings about the axis: that of the radius, u_r / r.
template <class T>
inline void add_hoop(CellStrain<2, T>& strain, const T& hoop)
{
  strain.increment[2] = hoop;
  strain.volumetric += hoop;
  strain.deviatoric = deviatoric_size<2>(strain.increment, strain.volumetric);
}

/// Replaces the volumetric part, spread over the normal components that the geometry has: in plane strain those in the
/// plane, so that the strain out of plane stays zero.
template <class G, int D = G::dim, class T>
inline void set_volumetric(CellStrain<D, T>& strain, const T& volumetric)
{
  const T change = (volumetric - strain.volumetric) / G::n_normal;
  for (int i = 0; i < G::n_normal; ++i)
    strain.increment[i] += change;
  strain.volumetric = volumetric;
  strain.deviatoric = deviatoric_size<D>(strain.increment, volumetric);
}

/// Small displacements: the strain changes stresses, but no volume, and nothing turns.
template <int D, class T>
inline void make_small(CellStrain<D, T>& strain)
{
  strain.volumetric = T{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      strain.rotation[i][j] = T{} + (i == j ? 1.0 : 0.0);
}
} // namespace mpm::transfer
