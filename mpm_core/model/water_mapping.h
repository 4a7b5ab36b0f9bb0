#pragma once
/// @file
/// What the nodes need to know of the pore water that moves by itself, and what they give to it.
///
/// With the soil's velocity v and the water's w, effective stress sigma' (tension positive), pore pressure p and
/// porosity n (Zienkiewicz and Shiomi 1984; particles of both phases in one: Jassim, Stolle and Vermeer 2013),
///
///     (1-n) rho_s dv/dt + n rho_w dw/dt = div(sigma' - p I) + rho g,
///     n rho_w dw/dt = -n grad p + n rho_w g - n^2 gamma_w / k (w - v),
///
/// and the mass of water in a volume V of soil, m_w = rho_w n V (1 + p / K_w), changes by what flows through it,
/// dm_w/dt = -V div j, j = n rho_w (w - v). Grains keep their volume.

#include "model/model.h"

namespace mpm::model
{
/// Gives the water of all particles its own mass and velocity, which begins as that of the soil.
/// @post particle masses are those of the grains
/// @throws InputError water that is incompressible, or heavier than its particle; on all ranks
/// @note Collective
template <class G>
void split_phases(Model<G>& model);

/// Gives particles the mass of water of full pores at their pressures, as after pressures or porosities were set.
/// @pre has_two_phases(model)
template <class G>
void fill_pores(Model<G>& model);

/// Sums of the water over the particles, at the nodes: masses, momenta, forces of the pore pressures, volumes of the
/// soil and coefficients of the drag; of this rank. Pressures are averaged as the soil's stresses are.
/// @note Collective where stresses are integrated over whole cells, or averaged
template <class G>
void water_to_nodes(const Mesh<G::dim>& mesh, NodeExchange& exchange, const Particles<G::dim>& particles,
                    const std::vector<Run>& runs, const PoreWater& water, const VelocityField<G>& soil,
                    WaterField<G>& field);

/// Mass flux of the water relative to the soil at the nodes, j_i = m_w,i / V_i (w_i - v_i).
///
/// Where pores may run empty, no water enters at the free surface: there is none outside, so that what flows inwards
/// leaves its place empty.
template <class G>
void find_flux(const Mesh<G::dim>& mesh, const VelocityField<G>& soil, const PoreWater& water, WaterField<G>& field);

/// Mass that flows out of a unit of volume of a cell over dt, dt div j [kg/m3].
template <class G>
double outflow(const Mesh<G::dim>& mesh, const WaterField<G>& field, Index cell, double dt);

/// Means of that over the cells around each node, with the weights of the nodal mixed discretisation.
/// @note Collective
template <class G>
void average_outflow(const Mesh<G::dim>& mesh, NodeExchange& exchange, double dt, WaterField<G>& field);

/// Mass that flows out of a unit of volume of a cell by these means, where pressures are averaged [kg/m3].
template <class G>
double averaged_outflow(const Mesh<G::dim>& mesh, const WaterField<G>& field, Index cell, double dt);
} // namespace mpm::model
