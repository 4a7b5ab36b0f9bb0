#pragma once
/// @file
/// The background mesh: linear simplices (triangles or tetrahedra) given by arrays. It carries no state of the soil.

#include "base/geometry.h"

#include <cmath>
#include <limits>
#include <span>

namespace mpm::mesh
{
/// Linear shape functions of one cell, about its centre: N_k(x) = 1/(D+1) + gradient[k] . (x - centre).
/// Written about the centre so that a mesh far from the origin loses no digits.
template <int D>
struct CellShape
{
  Vector<D> centre;
  std::array<Vector<D>, D + 1> gradient;
  double volume; ///< in two dimensions the area
};

/// No cell, or no tag.
inline constexpr Index none = -1;

/// Plain arrays that describe a mesh, as they come from DOLFINx. Not owned.
template <int D>
struct MeshInput
{
  std::span<const double> points;            ///< node coordinates [m], row-major (nodes, D)
  std::span<const Index> cells;              ///< nodes of each cell, row-major (cells, D+1); owned cells first
  std::span<const Index> cell_tags;          ///< (cells), or empty
  std::span<const Index> facets;             ///< nodes of each tagged facet, row-major (facets, D)
  std::span<const Index> facet_tags;         ///< (facets)
  std::span<const GlobalIndex> global_nodes; ///< (nodes), or empty on one rank
  std::span<const GlobalIndex> global_cells; ///< (cells), or empty on one rank
  std::span<const Index> cell_owners;        ///< rank that owns each cell (cells), or empty on one rank
};

template <int D>
struct Mesh
{
  std::vector<Vector<D>> points;
  std::vector<std::array<Index, D + 1>> cells;
  Array<CellShape<D>> shapes;
  /// Cell across the facet opposite to vertex k, or `none`
  std::vector<std::array<Index, D + 1>> neighbours;
  std::vector<Index> cell_tags;
  /// Tag of the facet opposite to vertex k, or `none`
  std::vector<std::array<Index, D + 1>> facet_tags;
  std::vector<GlobalIndex> global_nodes;
  std::vector<GlobalIndex> global_cells;
  std::vector<Index> cell_owners;
  /// Cells [0, owned_cells) belong to this rank, the others are ghosts
  Index owned_cells = 0;
  /// Round-off of shape functions, since positions have one: eps |x| / h, at least eps, where it is largest on this
  /// rank
  double round_off = std::numeric_limits<double>::epsilon();

  /// Bins of a regular grid over the mesh that hold the cells whose boxes touch them; for points far from any guess.
  struct Bins
  {
    Vector<D> origin;
    double size = 1;
    std::array<Index, D> counts;
    std::vector<Index> offsets;
    std::vector<Index> cells;
  } bins;

  Index n_nodes() const { return static_cast<Index>(points.size()); }
  Index n_cells() const { return static_cast<Index>(cells.size()); }
};

/// The mesh with shape functions, neighbours and tags.
/// @throws InputError wrong lengths, values that are not finite, node numbers out of range, a cell without volume,
/// cells that overlap their neighbour (inverted), a facet shared by more than two cells, a tagged facet that is none
template <int D>
Mesh<D> make_mesh(const MeshInput<D>& input, int rank);

/// Shape functions of a cell by the places of its nodes as they are.
template <int D>
CellShape<D> shape_of_cell(const Mesh<D>& mesh, Index cell);

/// Volume of a cell [m^3 per metre or radian in two dimensions]: the integral of the geometry's thickness.
template <class G>
inline double cell_volume(const CellShape<G::dim>& shape)
{
  return thickness<G>(shape.centre) * shape.volume;
}

/// What a radial velocity of one vertex is to the hoop strain rate of its cell: N_k(centre) / r_c [1/m].
template <class G>
inline double hoop_gradient(const CellShape<G::dim>& shape)
{
  if constexpr (G::has_hoop)
    return 1 / ((G::dim + 1) * shape.centre[0]);
  else
    return 0;
}

/// Derivative of the volumetric strain of a cell by the displacement of vertex k.
template <class G, int D = G::dim>
Vector<D> dilation_gradient(const CellShape<D>& shape, int k)
{
  Vector<D> gradient = shape.gradient[k];
  if constexpr (G::has_hoop)
    gradient[0] += hoop_gradient<G>(shape);
  return gradient;
}

/// Smallest altitude of a cell [m], the length h of (16)
template <int D>
double smallest_altitude(const CellShape<D>& shape);

/// Shape functions at point x
template <int D>
inline std::array<double, D + 1> shape_functions(const CellShape<D>& shape, const Vector<D>& x)
{
  std::array<double, D + 1> n;
  for (int k = 0; k <= D; ++k)
  {
    n[k] = 1.0 / (D + 1);
    for (int i = 0; i < D; ++i)
      n[k] += shape.gradient[k][i] * (x[i] - shape.centre[i]);
  }
  return n;
}

/// The point of a cell where the shape functions have given values.
template <int D>
inline Vector<D> point_in_cell(const Mesh<D>& mesh, Index cell, const std::array<double, D + 1>& n)
{
  Vector<D> x{};
  for (int k = 0; k <= D; ++k)
    for (int i = 0; i < D; ++i)
      x[i] += n[k] * mesh.points[mesh.cells[cell][k]][i];
  return x;
}

/// Size h of a simplex [m]: side of the square or cube that D! of its volume fill, (D! V)^(1/D).
///
/// Softening spreads over a band one row of cells wide, and rows of simplices are as wide as the squares or cubes that
/// they come from; V^(1/D) would be 1 / sqrt(2) of that in the plane and 0.55 in space (Rots 1988, Computational
/// modeling of concrete fracture, Delft: sqrt(2 A) for linear triangles).
/// @param volume  [m2 or m3]
template <int D>
inline double cell_size(double volume)
{
  if constexpr (D == 2)
    return std::sqrt(2 * volume);
  else
    return std::cbrt(6 * volume);
}

/// Local nodes of the facet opposite to vertex k of a cell
template <int D>
inline std::array<Index, D> facet_nodes(const std::array<Index, D + 1>& cell, int k)
{
  std::array<Index, D> nodes;
  for (int i = 0, j = 0; i <= D; ++i)
    if (i != k)
      nodes[j++] = cell[i];
  return nodes;
}
} // namespace mpm::mesh
