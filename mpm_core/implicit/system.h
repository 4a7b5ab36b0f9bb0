#pragma once
/// @file
/// The linear system of a Newton iteration, as coordinate (COO) entries: who has which rows, and the values.
///
/// Unknowns are the corrections of the displacement increment u at active nodes, D for each, in the order of the nodes'
/// numbers. Supported directions are projected out of rows and columns, P J P + s (1 - P), whatever their angle.

#include "implicit/implicit_step.h"

namespace mpm
{
/// The nodes of the system.
template <int D>
struct ImplicitSystem
{
  std::vector<GlobalIndex> number;          ///< per node: its number over all ranks, or `none` where it is not active
  std::vector<Index> owned;                 ///< nodes whose rows this rank has, by rising number
  std::vector<Index> cells;                 ///< filled cells of this rank
  std::vector<std::array<Index, 2>> ghosts; ///< opposite nodes of the stabilised facets
  std::vector<Index> support;               ///< per node: its support, or `none`
  std::vector<double> diagonal;             ///< per node: elastic stiffness, the scale of its entries [N/m]
  GlobalIndex total = 0;                    ///< nodes over all ranks
};

/// Entries that are added up where rows and columns repeat. Rows may be another rank's.
struct CooEntries
{
  std::vector<GlobalIndex> rows, columns;
  std::vector<double> values;
};

/// Numbers the active nodes of the step: consecutive on each rank.
/// @returns whether nodes or cells differ on any rank from what the system had before
/// @note Collective
template <class G, int D = G::dim>
bool number_nodes(Model<G>& model, const ImplicitStep<G>& step, ImplicitSystem<D>& system);

/// J = d (f_int + inertia) / du; with nodal mixed discretisation at constant averaged volumetric strain.
/// @pre the step's tangents belong to the iterate
/// @post the order of the entries is always the same for the same system; rows and columns are filled when they are
/// empty
template <class G, int D = G::dim>
void stiffness_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                       CooEntries& entries);

/// With nodal mixed discretisation, J gains K_p G: K_p = d f_int / d theta, rows for displacements, columns for nodes,
/// ...
template <class G, int D = G::dim>
void volumetric_force_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                              CooEntries& entries);

/// ... and G = d theta / du, the nodes' averaged volumetric strain; the product has the two-ring stencil.
template <class G, int D = G::dim>
void volumetric_strain_entries(const Model<G>& model, const ImplicitSystem<D>& system, CooEntries& entries);

/// Where mean stresses are averaged as well, J gains G^T (L + H G), with these L = d q / du and H = d q / d theta: q_i
/// is what the nodes' averaged volumetric strains work against, the cells' means of V sigma, shared among their nodes.
template <class G, int D = G::dim>
void mean_stress_entries(const Model<G>& model, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                         CooEntries& by_displacement, CooEntries& by_strain);

/// Vectors at this rank's nodes of the system, one after the other.
template <int D>
std::vector<double> owned_values(const ImplicitSystem<D>& system, std::span<const Vector<D>> nodal);

/// The opposite: values at all nodes of this rank; nodes that are not in the system become zero.
/// @note Collective
template <int D>
void set_nodal(NodeExchange& exchange, const ImplicitSystem<D>& system, std::span<const double> values,
               std::span<Vector<D>> nodal);
} // namespace mpm
