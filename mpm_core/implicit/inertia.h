#pragma once
/// @file
/// Inertia of an implicit step, with what damping adds to it: a term of its residual, and of its tangent.

#include "implicit/damped_inertia.h"
#include "implicit/entries.h"

namespace mpm::implicit
{
/// The force of one component of a node for its velocities at start and end of the stage, and its derivative by the
/// iterate.
template <class G>
Inertia stage_inertia(const ImplicitStep<G>& step, double mass, Index node, double start, double end);

/// M (v1 - v0) / dt + D + alpha M v1 of the iterate `field.velocity`; nothing in a quasi-static step.
/// @param owned  per node: 1 on exactly one of the ranks that share it
template <class G, int D = G::dim>
void add_inertia_forces(const VelocityField<G>& field, const ImplicitStep<G>& step,
                        std::span<const unsigned char> owned, std::vector<NodalForces<D>>& forces);

/// Its derivative by u, of the nodes whose rows this rank has; zeros in a quasi-static step, so that the matrix has the
/// same entries.
template <class G, int D = G::dim>
void add_inertia_entries(const VelocityField<G>& field, const ImplicitStep<G>& step, std::span<const Index> owned,
                         TangentSum<D>& tangent);

/// omega of each node [rad/s]: that of its oscillation in shear against its neighbours, sqrt(sum_p V_p G |grad N|^2 /
/// m) (T5). The yielding soil slides by shear, and of the oscillations at the mesh's scale those in shear are slowest.
/// @param stiffness  sum_p V_p G |grad N|^2 of each node, over all ranks [N/m]
template <int D>
std::vector<double> shear_frequencies(std::span<const double> stiffness, std::span<const NodeSums<D>> nodes);
} // namespace mpm::implicit
