#pragma once
/// @file
/// The pore water of the particles at the end of an implicit step.

#include "implicit/step.h"
#include "model/model.h"

namespace mpm::implicit
{
/// Adds the increments of pressure to the particles, gives them the gradient at the end, and lets porosity follow the
/// volume (grains do not change theirs) and, where the model says so, conductivity the porosity.
/// @pre particles are where they were at the step's start
template <class G>
void update_pore_water(Model<G>& model, const ImplicitStep<G>& step);

/// Adds what entered in the step at the nodes of this rank with a prescribed pressure, less what left at the free
/// surface.
template <class G>
void add_inflow(const Mesh<G::dim>& mesh, const ImplicitStep<G>& step, std::span<const unsigned char> owned,
                PoreWater& water);
} // namespace mpm::implicit
