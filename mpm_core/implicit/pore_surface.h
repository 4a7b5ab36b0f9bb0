#pragma once
/// @file
/// The free surface of the soil within cells, where the pore water has the pressure p_s of the water that stands there.
///
/// A plane surface at the height s below (s < 0) or above a node, over the size h of the cells around it, fills the hat
/// function of that node by f = 1 - (1 - s/h)^2 / 2 above, (1 + s/h)^2 / 2 below. Inverted, the filled parts of the
/// nodes give a distance, linear in each cell, which is zero at the surface. There p = p_s is imposed by a penalty,
///
///     Lambda (p - p_s) with Lambda = beta (k dt / (gamma_w h) + (1 / M + n / K_w) h) per area,
///
/// of which the first term is large beside the flow through a cell, the second beside its storage; the error is that of
/// a surface h / beta further out. Where soil may dry, above standing water, less than that enters: the rain.

#include "implicit/step.h"

namespace mpm::implicit
{
/// Finds the points of the free surface in the cells that it cuts, but for those that rigid surfaces cover.
///
/// Where it is in cells without particles next to them, rain falls on the nodes that these share.
/// @pre flux and compliance of the cells are known, and bounds of the contacts
/// @note Collective
template <class G, int D = G::dim>
void find_surface(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const NodalWater> nodes,
                  const PoreWater& water, std::span<const Contact<D>> contacts, ImplicitStep<G>& step);

/// Lets points of the surface that take all the rain have outflow where the pressure under the iterate is too high for
/// that, and the others take the rain where they take up more than that.
/// @returns whether any point of any rank has changed: then the iterate is no solution any more
/// @note Collective
template <class G, int D = G::dim>
bool revise_surface(const Mesh<D>& mesh, MPI_Comm comm, ImplicitStep<G>& step);
} // namespace mpm::implicit
