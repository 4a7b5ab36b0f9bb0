#pragma once
/// @file
/// Placing particles.

#include "mesh/mesh.h"
#include "particles/particles.h"

#include <optional>

namespace mpm::particles
{
/// Barycentric coordinates of `count` points placed evenly in a simplex, each representing the same fraction of its
/// volume. Rows of D+1 numbers. The points are the lattice of 1, 3, 6, 10, 15, ... points (triangle) or 1, 4, 10, 20,
/// ... (tetrahedron), in the cell itself or in each of the 4^s (8^s) cells it divides into: 1 3 4 6 10 12 15 16 21 24
/// ... in a triangle.
/// @throws InputError a count that has no such arrangement; the message names the nearest ones that have
template <int D>
std::vector<std::array<double, D + 1>> even_points(int count);

/// What seeded particles are made of.
struct SeedMaterial
{
  Index material = 0;
  double density = 0; ///< [kg/m3]
};

/// Adds `per_cell` particles to each owned cell with this tag (all owned cells without a tag). Numbers them by
/// `global cell number * per_cell + k + first_id`, so they do not depend on the partition.
/// @returns number of particles added on this rank
/// @throws InputError per_cell, density
template <class G, int D = G::dim>
Index seed_cells(const Mesh<D>& mesh, std::optional<Index> tag, int per_cell, SeedMaterial soil, GlobalIndex first_id,
                 Particles<D>& particles);

/// Adds one particle at each given point that lies in an owned cell.
/// @param points   (n, D) row-major [m]
/// @param volumes  (n) [m^D]
/// @param ids      (n) of the particles
/// @returns number of particles added on this rank
template <int D>
Index seed_points(const Mesh<D>& mesh, std::span<const double> points, std::span<const double> volumes,
                  std::span<const GlobalIndex> ids, SeedMaterial soil, Particles<D>& particles);

/// Loads the particles next to the facets with this tag: in each filled cell behind such a facet, the force
/// `traction * facet area` is shared evenly by the particles nearest to it. The force is dead: it moves with its
/// particles and keeps its direction.
/// @returns area [m^(D-1)] of the loaded facets on this rank
/// @throws InputError where the cell behind such a facet rests
template <class G>
double load_facets(const Mesh<G::dim>& mesh, Index facet_tag, const Vector<G::dim>& traction,
                   Particles<G::dim>& particles);
} // namespace mpm::particles
