#pragma once
/// @file
/// Stresses of a trial increment, from the step's start, without touching the particles.

#include "implicit/step.h"
#include "model/material_points.h"

namespace mpm::implicit
{
/// What a trial found among this rank's particles.
template <int D>
struct TrialCount
{
  std::int64_t plastic = 0;
  std::int64_t failed = 0;           ///< particles whose law failed, and runs in cells that would lose their volume
  std::optional<Failure<D>> failure; ///< the first of them
};

/// Updates the stresses of all particles over dt with the iterate `field.velocity`, batch by batch on copies, and sums
/// V sigma, and the tangents when wanted, over each owned cell.
/// @pre with nodal mixed discretisation, `field.volumetric_strain` belongs to the iterate
template <class G, int D = G::dim>
TrialCount<D> try_stresses(const Mesh<D>& mesh, const MaterialPoints<D>& material, const VelocityField<G>& field,
                           bool tangents, ImplicitStep<G>& step);
} // namespace mpm::implicit
