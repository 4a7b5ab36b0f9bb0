#pragma once
/// @file
/// The few vector and tensor operations that the kernels need. Loops of constant length, unrolled by the compiler.

#include "base/types.h"

#include <cmath>

namespace mpm::base
{
template <int D>
using Matrix = std::array<Vector<D>, D>; // row-major

/// Number of independent entries of a symmetric D x D matrix (in plane strain without zz).
template <int D>
inline constexpr int n_symmetric = D*(D + 1) / 2;

/// Row and column of entry k of a symmetric matrix: xx yy xy, or xx yy zz xy yz xz.
template <int D>
inline constexpr std::array<std::array<int, 2>, n_symmetric<D>> symmetric_pairs = []
{
  if constexpr (D == 2)
    return std::array<std::array<int, 2>, 3>{{{0, 0}, {1, 1}, {0, 1}}};
  else
    return std::array<std::array<int, 2>, 6>{{{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};
}();

/// Component of stress that entry k of a symmetric matrix is: skips zz in plane strain.
template <int D>
inline constexpr std::array<int, n_symmetric<D>> stress_component = []
{
  if constexpr (D == 2)
    return std::array<int, 3>{0, 1, 3};
  else
    return std::array<int, 6>{0, 1, 2, 3, 4, 5};
}();

/// Entry of a symmetric matrix at row i, column j.
template <int D>
constexpr int symmetric_index(int i, int j)
{
  if (i == j)
    return i;
  if constexpr (D == 2)
    return 2;
  else
    return i + j == 1 ? 3 : (i + j == 3 ? 4 : 5);
}

template <int D>
inline double dot(const Vector<D>& a, const Vector<D>& b)
{
  double sum = 0;
  for (int i = 0; i < D; ++i)
    sum += a[i] * b[i];
  return sum;
}

/// sum += factor a
template <int D>
inline void add(double factor, const Matrix<D>& a, Matrix<D>& sum)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      sum[i][j] += factor * a[i][j];
}

template <int D>
inline Matrix<D> product(const Matrix<D>& a, const Matrix<D>& b)
{
  Matrix<D> c{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k)
        c[i][j] += a[i][k] * b[k][j];
  return c;
}

template <int D>
inline Vector<D> product(const Matrix<D>& a, const Vector<D>& b)
{
  Vector<D> c;
  for (int i = 0; i < D; ++i)
    c[i] = dot<D>(a[i], b);
  return c;
}

template <int D>
inline Vector<D> difference(const Vector<D>& a, const Vector<D>& b)
{
  Vector<D> c;
  for (int i = 0; i < D; ++i)
    c[i] = a[i] - b[i];
  return c;
}

inline Vector<3> cross(const Vector<3>& a, const Vector<3>& b)
{
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <int D>
inline double norm(const Vector<D>& a)
{
  return std::sqrt(dot<D>(a, a));
}

/// The rotation of a spin over a step, its Cayley transform (Hughes & Winget 1980): orthogonal however large the spin.
/// @param half_spin  half of the step's rotation, antisymmetric
template <int D, class T>
inline std::array<std::array<T, D>, D> cayley_rotation(const std::array<std::array<T, D>, D>& half_spin)
{
  T half_angle_squared{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < i; ++j)
      half_angle_squared += half_spin[i][j] * half_spin[i][j];
  // (1 - W)^-1 (1 + W) = 1 + 2 (W + W W) / (1 + |w|^2) for the antisymmetric W of axial vector w
  const T scale = 2 / (1 + half_angle_squared);
  std::array<std::array<T, D>, D> rotation;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
    {
      T square{};
      for (int k = 0; k < D; ++k)
        square += half_spin[i][k] * half_spin[k][j];
      rotation[i][j] = (i == j ? 1.0 : 0.0) + scale * (half_spin[i][j] + square);
    }
  return rotation;
}
} // namespace mpm::base
