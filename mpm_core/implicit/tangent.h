#pragma once
/// @file
/// The tangent of one cell of an implicit step.

#include "implicit/implicit_step.h"
#include "transfer/kinematics.h"

namespace mpm
{
/// @param c       sum V dsigma/dstrain over the cell's particles, without zz in plane strain
/// @param stress  sum V sigma at the increment's end
/// @param strain  strain and rotation of the increment
template <int D>
CellTangent<D> cell_tangent(const std::array<std::array<double, n_symmetric<D>>, n_symmetric<D>>& c,
                            const std::array<double, n_symmetric<D>>& stress, const CellStrain<D>& strain,
                            const ImplicitOptions& options);
} // namespace mpm
