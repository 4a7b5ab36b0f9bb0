#pragma once
/// @file
/// The rotation of the material in an increment, for tensors among the states of a law. Stresses have been rotated
/// before the law is called.

#include "base/tensor.h"
#include "materials/laws/batch.h"

namespace mpm::materials
{
/// Rotation in an increment of the deformation gradient: the Cayley transform of its spin
template <int D>
Matrix<D> rotation_of(const Matrix<D>& deformation)
{
  Matrix<D> half_spin;
  for (std::size_t i = 0; i < D; ++i)
    for (std::size_t j = 0; j < D; ++j)
      half_spin[i][j] = 0.25 * (deformation[i][j] - deformation[j][i]);
  return cayley_rotation<D>(half_spin);
}

/// R a R^T
template <int D>
SymTensor<D> rotated(const Matrix<D>& rotation, const SymTensor<D>& a)
{
  SymTensor<D> result = a; // keeps zz in plane strain
  for (std::size_t k = 0; k < n_symmetric<D>; ++k)
  {
    const auto [i, j] = symmetric_pairs<D>[k];
    double entry = 0;
    for (int l = 0; l < D; ++l)
      for (int m = 0; m < D; ++m)
        entry += rotation[static_cast<std::size_t>(i)][static_cast<std::size_t>(l)] *
                 a[static_cast<std::size_t>(stress_component<D>[static_cast<std::size_t>(symmetric_index<D>(l, m))])] *
                 rotation[static_cast<std::size_t>(j)][static_cast<std::size_t>(m)];
    result[static_cast<std::size_t>(stress_component<D>[k])] = entry;
  }
  return result;
}
} // namespace mpm::materials
