#pragma once
/// @file
/// The nodes of the linear system of a Newton iteration: who has which rows.
///
/// Unknowns are the corrections of the displacement increment u at active nodes, D for each, in the order of the nodes'
/// numbers; where water flows, that of the pressure increment over its unit follows those of its node. Supported
/// directions are projected out of rows and columns, P J P + s (1 - P), whatever their angle.

#include "implicit/step.h"

namespace mpm::implicit
{
/// A node on the border of the far field, which any rank may have.
template <int D>
struct BorderNode
{
  GlobalIndex number;  ///< in the system
  Matrix<D> projector; ///< its P
};

/// The nodes of the system.
template <int D>
struct ImplicitSystem
{
  std::vector<GlobalIndex> number;          ///< per node: its number over all ranks, or `none` where it is not active
  std::vector<Index> owned;                 ///< nodes whose rows this rank has, by rising number
  std::vector<Index> cells;                 ///< filled cells of this rank
  std::vector<std::array<Index, 2>> ghosts; ///< opposite nodes of the stabilised facets
  std::vector<Index> support;               ///< per node: its support, or `none`
  std::vector<Matrix<D>> projectors;        ///< P = 1 - sum d d^T of each support
  std::vector<double> diagonal;             ///< per node: elastic stiffness, the scale of its entries [N/m]
  std::vector<BorderNode<D>> border;        ///< all nodes of the border of the far field
  AveragedGroups groups;                    ///< of the cells, with nodal mixed discretisation
  std::vector<GlobalIndex> number_of_mean;  ///< likewise of each mean of a node, where there are several groups
  GlobalIndex total = 0;                    ///< nodes over all ranks
  bool has_contacts = false;                ///< with rigid surfaces
  int unknowns = D;                         ///< of each node
};

/// Numbers the active nodes of the step: consecutive on each rank.
/// @returns whether nodes or cells differ on any rank from what the system had before
/// @throws RunError on all ranks: the soil has left a node on the border of the far field
/// @note Collective
template <class G, int D = G::dim>
bool number_nodes(NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step,
                  ImplicitSystem<D>& system);

/// Numbers of the means of this rank's nodes over all ranks: those of a node follow each other.
template <int D>
inline std::span<const GlobalIndex> numbers_of_means(const ImplicitSystem<D>& system)
{
  return system.groups.count == 1 ? system.number : system.number_of_mean;
}

/// P of a node: a vector without its supported directions.
template <int D>
inline Matrix<D> projector(const ImplicitSystem<D>& system, Index node)
{
  if (system.support[node] != none)
    return system.projectors[static_cast<std::size_t>(system.support[node])];
  Matrix<D> identity{};
  for (int i = 0; i < D; ++i)
    identity[i][i] = 1;
  return identity;
}

/// Vectors at this rank's nodes of the system, one after the other.
template <int D>
std::vector<double> owned_values(const ImplicitSystem<D>& system, std::span<const Vector<D>> nodal);

/// The opposite: values at all nodes of this rank; nodes that are not in the system become zero.
/// @note Collective
template <int D>
void set_nodal(NodeExchange& exchange, const ImplicitSystem<D>& system, std::span<const double> values,
               std::span<Vector<D>> nodal);
} // namespace mpm::implicit
