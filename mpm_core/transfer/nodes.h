#pragma once
/// @file
/// From cell moments to nodal sums. Conservative: the sum over nodes equals the sum over particles.

#include "mesh/part.h"
#include "transfer/moments.h"

#include <span>

namespace mpm
{
/// Nodal sums of one step; plain doubles, so that shared nodes are summed in one message.
template <int D>
struct NodeSums
{
  double mass;        ///< m_i (11)
  Vector<D> momentum; ///< sum m_p N_i v_p
  Vector<D> internal; ///< f_int,i (14)
  Vector<D> traction; ///< the part of f_ext,i (15) that boundary particles carry
};

/// f_int of a vertex of a cell: B^T sum V_p sigma_p, from the sum and the gradient of its shape function
template <int D>
inline Vector<D> internal_force(const std::array<double, n_symmetric<D>>& stress, const Vector<D>& gradient)
{
  Vector<D> force{};
  for (int k = 0; k < n_symmetric<D>; ++k)
  {
    const auto [i, j] = symmetric_pairs<D>[k];
    force[i] += stress[k] * gradient[j];
    if (i != j)
      force[j] += stress[k] * gradient[i];
  }
  return force;
}

/// Sums of mass, momentum, internal force and traction at the nodes of a part of the mesh over its cells.
/// @param tractions  one per cell, or empty
template <int D>
void scatter(const Mesh<D>& mesh, const MeshPart& part, std::span<const CellMoments<D>> cells,
             std::span<const TractionMoments<D>> tractions, std::span<NodeSums<D>> nodes);

/// The momentum `sum m_p N_i sum_j N_j change_j` of particles that all had the velocity of the nodal field `change` at
/// their place: the consistent mass matrix times `change`. The particles are not visited.
template <int D>
void scatter_momentum(const Mesh<D>& mesh, const MeshPart& part, std::span<const CellMoments<D>> cells,
                      std::span<const Vector<D>> change, std::span<Vector<D>> momentum);
} // namespace mpm
