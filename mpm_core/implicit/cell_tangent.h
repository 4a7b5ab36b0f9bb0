#pragma once
/// @file
/// The tangent of one cell of an implicit step.

#include "implicit/step.h"
#include "transfer/kinematics.h"

namespace mpm::implicit
{
/// @param c       sum V dsigma/dstrain over the cell's particles, of the components that do work
/// @param stress  sum V sigma at the increment's end
/// @param strain  strain and rotation of the increment
/// @param averaged_strain  fraction of nodal mixed discretisation of the strain, see `averaged_strain_fraction`
/// @param averaged_force  that of the forces, see `averaged_fraction`
template <class G, int D = G::dim>
CellTangent<G> cell_tangent(const std::array<Working<G>, G::n_working>& c, const Working<G>& stress,
                            const CellStrain<D>& strain, const ImplicitOptions& options, double averaged_strain,
                            double averaged_force);
} // namespace mpm::implicit
