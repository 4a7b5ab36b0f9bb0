#pragma once
/// @file
/// The internal force of an implicit step: a term of its residual, and of its tangent.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// f_int (14) of the trial's stresses.
template <class G, int D = G::dim>
void add_internal_forces(const Mesh<D>& mesh, const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces);

/// d f_int / du, at constant averaged volumetric strain with nodal mixed discretisation.
/// @pre the step's tangents belong to the iterate
template <class G, int D = G::dim>
void add_internal_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, TangentSum<D>& tangent);
} // namespace mpm::implicit
