#pragma once
/// @file
/// The stiffness of the far field, a term of the residual of an implicit step and of its tangent.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// -K u over the increment u of the step so far: what the displacement of the border changes in the external forces of
/// the far field, which has its other ones from the step's start.
/// @note Collective where there is a far field
template <class G, int D = G::dim>
void add_border_forces(const NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step,
                       std::vector<NodalForces<D>>& forces);

/// K: the rows of this rank's nodes of the border, full.
template <int D>
void add_border_entries(const FarField<D>& far, const ImplicitSystem<D>& system, TangentSum<D>& tangent);
} // namespace mpm::implicit
