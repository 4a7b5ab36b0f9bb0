#pragma once
/// @file
/// The ghost penalty of an implicit step: a term of its residual, and of its tangent. See ghost_facets.h.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// Forces of the penalty for the iterate `field.velocity`.
template <class G, int D = G::dim>
void add_ghost_forces(const VelocityField<G>& field, const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces);

/// Their derivatives by u: rows of the nodes to whose forces this rank adds; the same from both sides of a rank
/// boundary.
template <class G, int D = G::dim>
void add_ghost_entries(const ImplicitStep<G>& step, TangentSum<D>& tangent);
} // namespace mpm::implicit
