#pragma once
/// @file
/// Small matrices as Eigen sees them, for algebra outside of the loops over particles.

#include "base/tensor.h"

#include <Eigen/Dense>

namespace mpm::base
{
/// A view of a matrix, row by row.
template <int D>
inline auto as_eigen(const Matrix<D>& a)
{
  return Eigen::Map<const Eigen::Matrix<double, D, D, Eigen::RowMajor>>(a.front().data());
}

template <int D>
inline Matrix<D> inverse(const Matrix<D>& a)
{
  Matrix<D> result;
  Eigen::Map<Eigen::Matrix<double, D, D, Eigen::RowMajor>>(result.front().data()) = as_eigen<D>(a).inverse();
  return result;
}
} // namespace mpm::base
