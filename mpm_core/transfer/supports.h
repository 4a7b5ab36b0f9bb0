#pragma once
/// @file
/// Boundary conditions: velocities prescribed at nodes, whole or along a direction.

#include "parallel/node_exchange.h"

#include <span>

namespace mpm::transfer
{
/// What is prescribed at a node: v . direction[k] = value[k] for k < count. The directions are orthonormal.
template <int D>
struct Support
{
  Index node;
  int count;
  std::array<Vector<D>, D> direction;
  std::array<double, D> value; ///< [m/s]
};

/// One boundary condition for all nodes on facets with a tag: v . normal = 0, or components of the velocity.
template <int D>
struct SupportRequest
{
  Index facet_tag;
  bool whole; ///< true: `vector` is the prescribed velocity, NaN where free; false: v . vector = 0 (roller)
  Vector<D> vector;
};

/// Per node: above zero where it lies on a facet with the tag, which only another rank may have.
/// @note Collective
template <int D>
std::vector<double> nodes_on_facets(const Mesh<D>& mesh, NodeExchange& exchange, Index facet_tag);

/// Merges the boundary conditions into one per node, sorted by node. Directions at a node are made orthonormal; a
/// condition that follows from the others adds nothing. In axial symmetry the nodes on the axis have no radial
/// velocity.
/// @throws InputError conditions that contradict each other at a node, a normal without length
/// @note Collective
template <class G>
std::vector<Support<G::dim>> make_supports(const Mesh<G::dim>& mesh, NodeExchange& exchange,
                                           std::span<const SupportRequest<G::dim>> requests);

/// Makes v satisfy the support, changing it only along the supported directions.
template <int D>
inline void impose(const Support<D>& support, Vector<D>& v)
{
  for (int k = 0; k < support.count; ++k)
  {
    const double change = support.value[k] - dot<D>(support.direction[k], v);
    for (int i = 0; i < D; ++i)
      v[i] += change * support.direction[k][i];
  }
}

/// Takes what is along supported directions out of a vector, such as a force.
template <int D>
inline void take_out_supported(const Support<D>& support, Vector<D>& v)
{
  Support<D> held = support;
  held.value.fill(0);
  impose<D>(held, v);
}
} // namespace mpm::transfer
