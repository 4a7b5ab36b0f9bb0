#pragma once
/// @file
/// How much of the normal force on a rigid surface the pore water of the soil carries.
///
/// No water passes the surface, which therefore carries the total stress, sigma_n' + p. Only sigma_n' causes friction
/// (Terzaghi 1936). With the area a of the soil that faces the surface at a node, and the normal force F there,
/// 1 / (sigma_n' + p) = a / F, so that the water carries the fraction p a / F of the force on a particle. The areas
/// that the particles cover themselves do not add up to that of the surface, and the stress of the soil is known within
/// cells only, of which those at the surface feel a part of F.

#include "mesh/mesh.h"
#include "parallel/node_exchange.h"

#include <span>
#include <vector>

namespace mpm::contact
{
/// The soil around a node, over all ranks; plain doubles.
template <int D>
struct SoilAround
{
  Vector<D> outward; ///< integral of N_i n over the surface of the soil, n out of it: sum V_c grad N_i [m2]
  double cells;      ///< number of cells with soil
};

/// Sums over the particles that touch a surface, times N_i; plain doubles.
template <int D>
struct PressedNode
{
  Vector<D> force; ///< normal to the surface [N]
  double area;     ///< that particles cover [m2]
};

/// a / F of the nodes [1/Pa], from which those of particles are interpolated: then the sum of p a over the surface is
/// right. Both are distributed over the cells around a node first, since particles that are not on a grid give areas
/// that alternate from node to node. Beside the end of a rigid surface, where the surface of the soil goes on, a is at
/// most twice the area that particles cover.
/// @param cells    with soil
/// @param pressed  of this rank
/// @note Collective
template <int D>
std::vector<double> areas_per_force(const Mesh<D>& mesh, NodeExchange& exchange, std::span<const Index> cells,
                                    std::span<const SoilAround<D>> soil, std::vector<PressedNode<D>> pressed);
} // namespace mpm::contact
