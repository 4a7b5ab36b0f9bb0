#include "model/anisotropy.h"

#include "base/eigen.h"

namespace mpm::model
{
namespace
{
template <int D>
Matrix<D> tensor_of(const PoreWater& water, Index material)
{
  Matrix<D> tensor{};
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      tensor[a][b] =
          water.anisotropy.empty() ? (a == b ? 1 : 0) : water.anisotropy[static_cast<std::size_t>(material)][a][b];
  return tensor;
}
} // namespace

template <int D>
Anisotropy<D> anisotropy_of(const PoreWater& water, Index material)
{
  const Matrix<D> tensor = tensor_of<D>(water, material);
  if (water.anisotropy.empty())
    return {tensor, 1, 1};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, D, D>> principal(as_eigen<D>(tensor),
                                                                             Eigen::EigenvaluesOnly);
  return {tensor, principal.eigenvalues().minCoeff(), principal.eigenvalues().maxCoeff()};
}

template <int D>
Matrix<D> resistance_of(const PoreWater& water, Index material)
{
  return inverse<D>(tensor_of<D>(water, material));
}

template Anisotropy<2> anisotropy_of<2>(const PoreWater&, Index);
template Anisotropy<3> anisotropy_of<3>(const PoreWater&, Index);
template Matrix<2> resistance_of<2>(const PoreWater&, Index);
template Matrix<3> resistance_of<3>(const PoreWater&, Index);
} // namespace mpm::model
