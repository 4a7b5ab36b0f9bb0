#pragma once
/// @file
/// Soil that dries in an implicit step, its air at atmospheric pressure.
///
/// With the saturation S, the effective one S_e and the relative permeability k_r of suction -p,
///
///     div(sigma' - S_e p I) + rho g = 0,    d/dt(S (n + e + n p / K_w)) + div q = 0,    k -> k_r k,
///
/// e being the volumetric strain. Every particle has its own, from its pressure; so the difference of the content of a
/// step is that of the water in the particles, and none is lost. rho follows from one step to the next.

#include "implicit/step.h"
#include "model/pore_water.h"

namespace mpm::implicit
{
/// Sums over the particles of all cells under the iterate: `pore.drying`.
/// @pre the rates of pressures are those of the iterate on all nodes of owned cells
template <class G, int D = G::dim>
void try_drying(const Mesh<D>& mesh, const Particles<D>& particles, const std::vector<Run>& runs,
                const VelocityField<G>& field, const PoreWater& water, ImplicitStep<G>& step);
} // namespace mpm::implicit
