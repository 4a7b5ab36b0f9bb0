#pragma once
/// @file
/// Boundary conditions in an implicit step.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// Makes the iterate `field.velocity` satisfy the supports.
template <class G>
void impose_supports(const ImplicitStep<G>& step, VelocityField<G>& field);

/// Supported directions in the tangent: their corrections are zero, by the equations s (1 - P) du = 0.
template <int D>
void add_support_entries(const ImplicitSystem<D>& system, TangentSum<D>& tangent);
} // namespace mpm::implicit
