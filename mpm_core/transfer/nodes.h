#pragma once
/// @file
/// From cell moments to nodal sums. Conservative: the sum over nodes equals the sum over particles.

#include "mesh/part.h"
#include "parallel/rounded_sums.h"
#include "transfer/by_vertex.h"

#include <limits>
#include <span>

namespace mpm::transfer
{
/// What all particles give to the nodes.
template <int D>
struct InnerSums
{
  double mass;        ///< m_i (11)
  Vector<D> momentum; ///< sum m_p N_i v_p
  Vector<D> internal; ///< f_int,i (14)
};

/// Nodal sums of one step; plain doubles, so that shared nodes are summed in one message.
template <int D>
struct NodeSums : InnerSums<D>
{
  Vector<D> traction; ///< the part of f_ext,i (15) that boundary particles carry
};

/// f_ext of a node under gravity [m/s2], with the tractions and the weight.
template <int D>
inline Vector<D> external_force(const NodeSums<D>& node, const Vector<D>& gravity)
{
  Vector<D> force;
  for (int a = 0; a < D; ++a)
    force[a] = node.traction[a] + node.mass * gravity[a];
  return force;
}

/// f_ext - f_int of a node under gravity [m/s2]
template <int D>
inline Vector<D> unbalanced_force(const NodeSums<D>& node, const Vector<D>& gravity)
{
  Vector<D> force = external_force<D>(node, gravity);
  for (int a = 0; a < D; ++a)
    force[a] -= node.internal[a];
  return force;
}

/// f_int of vertex k of a cell: B^T sum V_p sigma_p, from the sum and the gradient of its shape function
template <class G, int D = G::dim>
inline Vector<D> internal_force(const Working<G>& stress, const CellShape<D>& shape, int k)
{
  const Vector<D>& gradient = shape.gradient[k];
  Vector<D> force{};
  for (int c = 0; c < n_symmetric<D>; ++c)
  {
    const auto [i, j] = symmetric_pairs<D>[c];
    force[i] += stress[c] * gradient[j];
    if (i != j)
      force[j] += stress[c] * gradient[i];
  }
  if constexpr (G::has_hoop)
    force[0] += stress[n_symmetric<D>] * hoop_gradient<G>(shape);
  return force;
}

/// Adds the tractions in the cells of a part of the mesh to its nodes.
template <int D>
void scatter_tractions(const Mesh<D>& mesh, NodeExchange& exchange, const MeshPart& part,
                       std::span<const TractionMoments<D>> cells, std::span<NodeSums<D>> nodes)
{
  const auto traction_of = [nodes](Index node) -> Vector<D>& { return nodes[node].traction; };
  const auto each_term = [&](auto&& add)
  {
    for (Index c : part.cells)
      for (int k = 0; k <= D; ++k)
      {
        Vector<D> force;
        for (int a = 0; a < D; ++a)
          force[a] = at_vertex<D>(cells[c].force[a], cells[c].force_xi[a], mesh.shapes[c].gradient[k]);
        add(mesh.cells[c][k], force);
      }
  };
  sum_at_nodes<Vector<D>>(exchange, traction_of, each_term);
}

/// Sums of mass, momentum, internal force and traction at the nodes of a part of the mesh over its cells.
/// @param stress_of  what a cell integrates [N m], sum V_p sigma_p or what takes its place; a callable Index -> Working
/// @param tractions   one per cell, or empty
/// @param others      what the nodes have beside these cells, or empty
/// @param least_mass  [kg]
/// @returns whether a vertex gets no more than the least mass from a cell, whose particles then lie on the facet
/// opposite to it
/// @note Collective where the exchange asks for reproducible sums
template <class G, class StressOf>
bool scatter(const Mesh<G::dim>& mesh, NodeExchange& exchange, const MeshPart& part,
             std::span<const CellMoments<G>> cells, StressOf&& stress_of,
             std::span<const TractionMoments<G::dim>> tractions, std::span<const NodeSums<G::dim>> others,
             std::span<NodeSums<G::dim>> nodes, double least_mass = 0)
{
  constexpr int D = G::dim;
  double least = std::numeric_limits<double>::infinity();
  const auto each_term = [&](auto&& add)
  {
    for (Index c : part.cells)
    {
      const CellMoments<G>& moments = cells[c];
      if (moments.mass == 0)
        continue;
      const CellShape<D>& shape = mesh.shapes[c];
      const auto gradients = gradients_by_vertex<D>(shape);
      const ByVertex<D> mass = at_vertices<D>(moments.mass, moments.mass_xi, gradients);
      const Working<G> stress = stress_of(c);
      std::array<ByVertex<D>, D> momentum, internal;
      for (int a = 0; a < D; ++a)
      {
        momentum[a] = at_vertices<D>(moments.momentum[a], moments.momentum_xi[a], gradients);
        internal[a] = internal_forces<G>(stress, a, gradients, shape);
      }
      for (int k = 0; k <= D; ++k)
      {
        least = mass[k] < least ? mass[k] : least;
        InnerSums<D> term;
        term.mass = mass[k];
        for (int a = 0; a < D; ++a)
        {
          term.momentum[a] = momentum[a][k];
          term.internal[a] = internal[a][k];
        }
        add(mesh.cells[c][k], term);
      }
    }
  };
  if (others.empty())
    for (Index node : part.nodes)
      nodes[node] = {};
  else
    for (Index node : part.nodes)
      nodes[node] = others[node];
  sum_at_nodes<InnerSums<D>>(
      exchange, [nodes](Index node) -> InnerSums<D>& { return nodes[node]; }, each_term);
  if (!tractions.empty())
    scatter_tractions<D>(mesh, exchange, part, tractions, nodes);
  return least <= least_mass;
}

/// The momentum `sum m_p N_i sum_j N_j change_j` of particles that all had the velocity of the nodal field `change` at
/// their place: the consistent mass matrix times `change`. The particles are not visited.
/// @note Collective where the exchange asks for reproducible sums
template <class G>
void scatter_momentum(const Mesh<G::dim>& mesh, NodeExchange& exchange, const MeshPart& part,
                      std::span<const CellMoments<G>> cells, std::span<const Vector<G::dim>> change,
                      std::span<Vector<G::dim>> momentum);
} // namespace mpm::transfer
