#pragma once
/// @file
/// The external force of an implicit step, a term of its residual that does not depend on the iterate.

#include "implicit/step.h"

namespace mpm::implicit
{
/// f_ext (15) at the end of the stage, over all ranks; where the step applies a fraction of its load only, that
/// fraction of what is out of balance at its start.
/// The far field has its forces as they are at the step's start, on the nodes of this rank.
/// @param gravity  at the end of the stage [m/s2]
/// @param field    with sums of nodes at the step's start
template <class G>
std::vector<Vector<G::dim>> external_forces(const VelocityField<G>& field, const Vector<G::dim>& gravity,
                                            double load_fraction);

/// @param owned  per node: 1 on exactly one of the ranks that share it
template <class G, int D = G::dim>
void add_external_forces(const ImplicitStep<G>& step, std::span<const unsigned char> owned,
                         std::vector<NodalForces<D>>& forces);
} // namespace mpm::implicit
