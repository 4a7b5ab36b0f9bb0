#pragma once
/// @file
/// The free surface of the soil within cells, where the pore water has no pressure.
///
/// A plane surface at the height s below (s < 0) or above a node, over the size h of the cells around it, fills the hat
/// function of that node by f = 1 - (1 - s/h)^2 / 2 above, (1 + s/h)^2 / 2 below. Inverted, the filled parts of the
/// nodes give a distance, linear in each cell, which is zero at the surface. There p = 0 is imposed by a penalty,
///
///     Lambda p with Lambda = beta (k dt / (gamma_w h) + (1 / M + n / K_w) h) per area,
///
/// of which the first term is large beside the flow through a cell, the second beside its storage; the error is that of
/// a surface h / beta further out.

#include "implicit/step.h"

namespace mpm::implicit
{
/// Adds the outflow at the free surface to the cells that it cuts.
/// @param filled  volume of the soil that belongs to each node, sum V_p N_i, over all ranks
/// @pre flux and compliance of the cells are known
/// @note Collective
template <class G, int D = G::dim>
void drain_surface(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const double> filled, ImplicitStep<G>& step);
} // namespace mpm::implicit
