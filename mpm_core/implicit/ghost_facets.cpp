#include "implicit/ghost_facets.h"

#include <algorithm>

namespace mpm::implicit
{
namespace
{
/// What the facets of a cell depend on.
struct CellContents
{
  double volume; ///< filled
  double mass;
  double shear; ///< integral of the shear modulus over the filled volume
};

template <int D>
std::vector<CellContents> cell_contents(const Mesh<D>& mesh, const MaterialPoints<D>& points, const Halo& cells)
{
  std::vector<CellContents> contents(mesh.cells.size(), CellContents{});
  for (const Run& run : points.runs)
  {
    const double shear = mean_moduli(points, run).shear;
    for (Index p = run.first; p < run.last; ++p)
    {
      contents[run.cell].volume += points.particles.volume[p];
      contents[run.cell].mass += points.particles.mass[p];
      contents[run.cell].shear += points.particles.volume[p] * shear;
    }
  }
  update(cells, contents);
  return contents;
}

/// The facet of a cell opposite to vertex k, to a neighbour; without its coefficients.
template <int D>
GhostFacet<D> facet_between(const Mesh<D>& mesh, Index cell, int k, Index other)
{
  GhostFacet<D> facet{};
  const auto on_facet = facet_nodes<D>(mesh.cells[cell], k);
  std::copy(on_facet.begin(), on_facet.end(), facet.nodes.begin());
  int opposite = 0;
  while (std::find(on_facet.begin(), on_facet.end(), mesh.cells[other][opposite]) != on_facet.end())
    ++opposite;
  facet.nodes[D] = mesh.cells[cell][k];
  facet.nodes[D + 1] = mesh.cells[other][opposite];

  Vector<D> normal = mesh.shapes[cell].gradient[k]; // at right angles to the facet
  const double length = norm<D>(normal);
  for (Index c : {cell, other})
    for (int l = 0; l <= D; ++l)
    {
      const auto at = std::find(facet.nodes.begin(), facet.nodes.end(), mesh.cells[c][l]) - facet.nodes.begin();
      facet.jump[at] += (c == cell ? 1 : -1) * dot<D>(normal, mesh.shapes[c].gradient[l]) / length;
    }
  const bool shared = other >= mesh.owned_cells;
  facet.fraction.fill(shared ? 0.5 : 1);
  facet.fraction[D] = 1;
  facet.fraction[D + 1] = shared ? 0 : 1;
  return facet;
}

/// A facet of a cell without filled neighbours: the jump is to a gradient of zero, as a lone particle has none.
template <int D>
GhostFacet<D> outer_facet(const Mesh<D>& mesh, Index cell, int k)
{
  GhostFacet<D> facet{};
  const auto on_facet = facet_nodes<D>(mesh.cells[cell], k);
  std::copy(on_facet.begin(), on_facet.end(), facet.nodes.begin());
  facet.nodes[D] = facet.nodes[D + 1] = mesh.cells[cell][k];
  const Vector<D> normal = mesh.shapes[cell].gradient[k];
  for (int l = 0, at = 0; l <= D; ++l)
    facet.jump[l == k ? D : at++] = dot<D>(normal, mesh.shapes[cell].gradient[l]) / norm<D>(normal);
  facet.fraction.fill(1);
  facet.fraction[D + 1] = 0;
  return facet;
}

/// Weights of a facet of cell c, opposite to vertex k; h is the mean of both altitudes over it.
template <class G, int D = G::dim>
void set_weights(const Mesh<D>& mesh, Index c, int k, double volumes, const CellContents& both,
                 const GhostOptions& options, GhostFacet<D>& facet)
{
  // |grad N_k| is one over the altitude, so the facet's measure is D times the volume times that.
  // In axial symmetry both are those of one radian, at the cell's radius.
  const double area = D * cell_volume<G>(mesh.shapes[c]) * norm<D>(mesh.shapes[c].gradient[k]);
  const double h = D * volumes / (2 * area);
  facet.area = area;
  facet.size = h;
  facet.stiffness = options.stiffness * both.shear / both.volume * h * area;
  facet.mass = options.mass * both.mass / both.volume * h * h * h * area;
}
} // namespace

template <class G, int D>
std::vector<GhostFacet<D>> find_ghost_facets(const Mesh<D>& mesh, const MaterialPoints<D>& points, const Halo& cells,
                                             const GhostOptions& options)
{
  std::vector<GhostFacet<D>> facets;
  if (options.filled == 0)
    return facets;
  const auto contents = cell_contents(mesh, points, cells);
  const auto bad = [&](Index c) { return contents[c].volume < options.filled * cell_volume<G>(mesh.shapes[c]); };
  const auto filled = [&](Index c) { return c != none && contents[c].volume > 0; };
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    if (!filled(c))
      continue;
    const bool lone = bad(c) && std::none_of(mesh.neighbours[c].begin(), mesh.neighbours[c].end(), filled);
    for (int k = 0; k <= D; ++k)
    {
      const Index other = mesh.neighbours[c][k];
      if (lone)
      {
        GhostFacet<D> facet = outer_facet(mesh, c, k);
        set_weights<G>(mesh, c, k, cell_volume<G>(mesh.shapes[c]), contents[c], options, facet);
        facets.push_back(facet);
      }
      // Each facet once: from the lower of two owned cells, and from the owned cell where the other is a ghost.
      else if (filled(other) && (bad(c) || bad(other)) && (other > c || other >= mesh.owned_cells))
      {
        GhostFacet<D> facet = facet_between(mesh, c, k, other);
        const CellContents both{contents[c].volume + contents[other].volume, contents[c].mass + contents[other].mass,
                                contents[c].shear + contents[other].shear};
        set_weights<G>(mesh, c, k, cell_volume<G>(mesh.shapes[c]) + cell_volume<G>(mesh.shapes[other]), both, options,
                       facet);
        facets.push_back(facet);
      }
    }
  }
  return facets;
}

#define INSTANTIATE(G)                                                                                                 \
  template std::vector<GhostFacet<G::dim>> find_ghost_facets<G>(const Mesh<G::dim>&, const MaterialPoints<G::dim>&,    \
                                                                const Halo&, const GhostOptions&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
