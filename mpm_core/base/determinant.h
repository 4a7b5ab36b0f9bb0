#pragma once
/// @file
/// Determinants of the small matrices of cells.

#include "base/tensor.h"

namespace mpm
{
inline double determinant(const Matrix<2>& a) { return a[0][0] * a[1][1] - a[0][1] * a[1][0]; }

inline double determinant(const Matrix<3>& a)
{
  return a[0][0] * (a[1][1] * a[2][2] - a[1][2] * a[2][1]) - a[0][1] * (a[1][0] * a[2][2] - a[1][2] * a[2][0]) +
         a[0][2] * (a[1][0] * a[2][1] - a[1][1] * a[2][0]);
}
} // namespace mpm
