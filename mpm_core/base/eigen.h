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
} // namespace mpm::base
