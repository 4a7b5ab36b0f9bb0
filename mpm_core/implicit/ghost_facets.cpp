#include "implicit/ghost_facets.h"

#include "contact/clearance.h"
#include "implicit/contact_step.h"
#include "model/velocity_field.h"

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

/// Mass that each of some cells, in rising order, gives to its nodes.
template <int D>
std::vector<std::array<double, D + 1>> own_masses(const Mesh<D>& mesh, const MaterialPoints<D>& points,
                                                  const std::vector<Index>& cells)
{
  std::vector<std::array<double, D + 1>> masses(cells.size());
  for (const Run& run : points.runs)
  {
    const auto found = std::ranges::lower_bound(cells, run.cell);
    if (found == cells.end() || *found != run.cell)
      continue;
    for (Index p = run.first; p < run.last; ++p)
    {
      const auto weights = weights_at<D>(mesh.shapes[run.cell], at<D>(points.particles.position, p));
      for (int k = 0; k <= D; ++k)
        masses[found - cells.begin()][k] += weights[k] * points.particles.mass[p];
    }
  }
  return masses;
}

/// Of cells without filled neighbours, those that hang on other cells by so few nodes that they could turn about these:
/// no support and no rigid surface holds them.
/// @param lone  in rising order
template <class G>
std::vector<Index> hanging_cells(Model<G>& model, const MaterialPoints<G::dim>& points, const std::vector<Index>& lone)
{
  constexpr int D = G::dim;
  const VelocityField<G>& field = model.fields.front();
  std::vector<Index> hanging, supported;
  if (lone.empty())
    return hanging;
  for (const auto& support : field.supports)
    supported.push_back(support.node);
  std::ranges::sort(supported);
  for (auto& contact : model.contacts)
    contact::keep_clearance<D>(model.mesh, contact);
  const auto masses = own_masses(model.mesh, points, lone);
  for (std::size_t n = 0; n < lone.size(); ++n)
  {
    const auto cell = static_cast<std::size_t>(lone[n]);
    int held = 0;
    for (int k = 0; k <= D; ++k)
    {
      const Index node = model.mesh.cells[cell][k];
      held += field.nodes[node].mass > (1 + 1e-9) * masses[n][k] || std::ranges::binary_search(supported, node);
    }
    const bool touches = std::ranges::any_of(model.contacts, [cell](const auto& contact)
                                             { return contact::may_be_near(contact.bounds[cell], contact.travel); });
    if (held > 0 && held < D && !touches)
      hanging.push_back(lone[n]);
  }
  return hanging;
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

/// Centre of the facet of a cell opposite to vertex k.
template <int D>
Vector<D> facet_centre(const Mesh<D>& mesh, Index cell, int k)
{
  Vector<D> centre{};
  for (Index node : facet_nodes<D>(mesh.cells[cell], k))
    for (int a = 0; a < D; ++a)
      centre[a] += mesh.points[node][a] / D;
  return centre;
}

/// Area of the facet of a cell opposite to vertex k, in axial symmetry that of one radian at the radius of a point.
template <class G, int D = G::dim>
double area_at(const Mesh<D>& mesh, Index cell, int k, const Vector<G::dim>& point)
{
  // |grad N_k| is one over the altitude, so the facet's measure is D times the volume times that.
  return D * mesh.shapes[cell].volume * norm<D>(mesh.shapes[cell].gradient[k]) * thickness<G>(point);
}

/// Weights of a facet; h is the mean of both altitudes over it.
template <int D>
void set_weights(double area, double volumes, const CellContents& both, const GhostOptions& options,
                 GhostFacet<D>& facet)
{
  const double h = D * volumes / (2 * area);
  facet.area = area;
  facet.size = h;
  facet.stiffness = options.stiffness * both.shear / both.volume * h * area;
  facet.mass = options.mass * both.mass / both.volume * h * h * h * area;
}
} // namespace

template <class G, int D>
std::vector<GhostFacet<D>> find_ghost_facets(Model<G>& model, const MaterialPoints<D>& points, const Halo& cells,
                                             const GhostOptions& options, bool quasi_static)
{
  const Mesh<D>& mesh = model.mesh;
  std::vector<GhostFacet<D>> facets;
  if (options.filled == 0)
    return facets;
  const auto contents = cell_contents(mesh, points, cells);
  const auto bad = [&](Index c) { return contents[c].volume < options.filled * cell_volume<G>(mesh.shapes[c]); };
  const auto filled = [&](Index c) { return c != none && contents[c].volume > 0; };
  const auto alone = [&](Index c) { return filled(c) && std::ranges::none_of(mesh.neighbours[c], filled); };
  std::vector<Index> full_and_alone;
  for (Index c = 0; c < mesh.owned_cells && quasi_static; ++c) // with inertia they swing
    if (!bad(c) && alone(c))
      full_and_alone.push_back(c);
  const auto hanging = hanging_cells(model, points, full_and_alone);
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    if (!filled(c))
      continue;
    const bool lone = bad(c) ? alone(c) : std::ranges::binary_search(hanging, c);
    for (int k = 0; k <= D; ++k)
    {
      const Index other = mesh.neighbours[c][k];
      if (lone)
      {
        GhostFacet<D> facet = outer_facet(mesh, c, k);
        const double area = area_at<G>(mesh, c, k, mesh.shapes[c].centre); // a facet on the axis has none of its own
        set_weights<D>(area, cell_volume<G>(mesh.shapes[c]), contents[c], options, facet);
        facets.push_back(facet);
      }
      // Each facet once: from the lower of two owned cells, and from the owned cell where the other is a ghost.
      else if (filled(other) && (bad(c) || bad(other)) && (other > c || other >= mesh.owned_cells))
      {
        GhostFacet<D> facet = facet_between(mesh, c, k, other);
        const CellContents both{contents[c].volume + contents[other].volume, contents[c].mass + contents[other].mass,
                                contents[c].shear + contents[other].shear};
        // The same from both sides: in axial symmetry they have different radii.
        const double area = area_at<G>(mesh, c, k, facet_centre<D>(mesh, c, k));
        set_weights<D>(area, cell_volume<G>(mesh.shapes[c]) + cell_volume<G>(mesh.shapes[other]), both, options, facet);
        facets.push_back(facet);
      }
    }
  }
  return facets;
}

#define INSTANTIATE(G)                                                                                                 \
  template std::vector<GhostFacet<G::dim>> find_ghost_facets<G>(Model<G>&, const MaterialPoints<G::dim>&, const Halo&, \
                                                                const GhostOptions&, bool);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
