#pragma once
/// @file
/// What averaged volumetric strains and mean stresses add to the tangent of an implicit step, as factors of products
/// whose stencils are wider than that of a cell.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// With nodal mixed discretisation, J gains K_p G: K_p = d f_int / d theta, rows for displacements, columns for nodes,
/// and for the water that soil takes up which may dry; saturated soil goes by the volume of its cells itself; ...
template <class G, int D = G::dim>
void volumetric_force_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                              BlockEntries& entries);

/// ... and G = d theta / du, the nodes' averaged volumetric strain; the product has the two-ring stencil.
template <class G, int D = G::dim>
void volumetric_strain_entries(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitSystem<D>& system,
                               BlockEntries& entries);

/// Where mean stresses are averaged as well, J gains G^T (L + H G), with these L = d q / du and H = d q / d theta: q_i
/// is what the nodes' averaged volumetric strains work against, the cells' means of V sigma, shared among their nodes.
template <class G, int D = G::dim>
void mean_stress_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, const ImplicitSystem<D>& system,
                         BlockEntries& by_displacement, BlockEntries& by_strain);
} // namespace mpm::implicit
