#pragma once
/// @file
/// Ghost penalty: the remedy for nodes that carry hardly any mass and stiffness.
///
/// Where the body's boundary cuts a cell, its outer nodes hang on a few particles; where these carry no tension, on
/// nothing. The penalty ties the gradient in such a cell to that of its neighbour across their facet F, by forces
///
///     f_i = sum_F |F| [dN_i/dn] ( gamma_K G h [du/dn] + gamma_M rho h^3 [da/dn] ),   [.] the jump over F,
///
/// of the step's displacement u and acceleration a = (v1 - v0)/dt; with inertia u counts beyond what the velocity of
/// the step's start would give, dt (v - v0), so that a steady motion is not braked step by step (Burman 2010; Sticko &
/// Kreiss 2016 for the mass; Coombs 2023 in implicit MPM). Affine fields feel nothing of it, and only facets of badly
/// filled cells have it, so a body whose cells are filled is not touched. A cell that has no filled neighbour is tied
/// to a gradient of zero instead; so is, in steps without inertia, a filled cell that hangs on other cells by fewer
/// than D nodes, since nothing else keeps it from turning about them.

#include "model/material_points.h"
#include "parallel/halo.h"

namespace mpm::implicit
{
struct GhostOptions
{
  double stiffness = 0.1; ///< gamma_K, relative to the shear modulus
  double mass = 0.1;      ///< gamma_M, relative to the density
  double filled = 0.5;    ///< cells filled less than this fraction of their volume are stabilised; 0 for none
};

/// A facet between two filled cells of which at least one is badly filled.
template <int D>
struct GhostFacet
{
  std::array<Index, D + 2>
      nodes; ///< those of the facet, then the one opposite in each cell, that of the owned cell first
  std::array<double, D + 2> jump; ///< [dN/dn] of each node [1/m]
  /// Fraction of the force at each node that this rank adds: a facet to a ghost cell is on both ranks
  std::array<double, D + 2> fraction;
  double stiffness; ///< |F| gamma_K G h
  double mass;      ///< |F| gamma_M rho h^3
  double area;      ///< |F|
  double size;      ///< h
};

/// The stabilised facets of this rank's owned cells.
/// @param cells  halo of the mesh's cells
/// @pre the nodes have their masses
/// @note Collective over neighbours
template <class G, int D = G::dim>
std::vector<GhostFacet<D>> find_ghost_facets(Model<G>& model, const MaterialPoints<D>& points, const Halo& cells,
                                             const GhostOptions& options, bool quasi_static);

/// Jump over a facet of a nodal field, a callable Index -> Vector<D>
template <int D, class Nodal>
inline Vector<D> jump_over(const GhostFacet<D>& facet, Nodal&& nodal)
{
  Vector<D> jump{};
  for (int k = 0; k < D + 2; ++k)
  {
    const Vector<D> value = nodal(facet.nodes[k]);
    for (int a = 0; a < D; ++a)
      jump[a] += facet.jump[k] * value[a];
  }
  return jump;
}
} // namespace mpm::implicit
