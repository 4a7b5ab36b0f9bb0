#include "model/water_boundary.h"

#include <cmath>
#include <map>

namespace mpm::model
{
namespace
{
/// Below this length of the mean of unit normals the facets around a node meet under an angle of more than 37 degrees.
constexpr double nearly_plane = 0.95;

/// Sum of the outward normals of facets, and of their areas; plain doubles.
template <int D>
struct FacetNormal
{
  Vector<D> normal;
  double area;
};

/// Areas of the facets with a tag around each node.
/// @note Collective
template <int D>
std::vector<FacetNormal<D>> nodal_normals(const Mesh<D>& mesh, NodeExchange& exchange, Index facet_tag)
{
  std::vector<FacetNormal<D>> normals(mesh.points.size(), FacetNormal<D>{});
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (int k = 0; k <= D; ++k)
      if (mesh.facet_tags[c][k] == facet_tag)
        for (Index node : facet_nodes<D>(mesh.cells[c], k))
        {
          const Vector<D>& gradient = mesh.shapes[c].gradient[k]; // inward, one over the height
          normals[node].area += mesh.shapes[c].volume * norm<D>(gradient);
          for (int a = 0; a < D; ++a)
            normals[node].normal[a] -= mesh.shapes[c].volume * gradient[a];
        }
  sum_shared(exchange, normals);
  return normals;
}

/// The unit vector along a normal; all axes where facets meet under an angle.
template <int D>
void add_directions(const FacetNormal<D>& facets, ImperviousNode<D>& node)
{
  const double length = norm<D>(facets.normal);
  const bool plane = length > nearly_plane * facets.area;
  for (int a = 0; a < (plane ? 1 : D); ++a)
  {
    Vector<D> direction{};
    direction[a] = 1;
    for (int b = 0; plane && b < D; ++b)
      direction[b] = facets.normal[b] / length;
    add_direction<D>(direction, node);
  }
}
} // namespace

template <int D>
void add_direction(Vector<D> n, ImperviousNode<D>& node)
{
  for (int k = 0; k < node.count; ++k)
  {
    const double along = dot<D>(n, node.direction[k]);
    for (int a = 0; a < D; ++a)
      n[a] -= along * node.direction[k][a];
  }
  const double length = norm<D>(n);
  if (length < 1e-6)
    return;
  for (double& component : n)
    component /= length;
  node.direction[node.count++] = n;
}

template <class G>
void set_impervious(Model<G>& model, std::span<const Index> facet_tags, std::span<const Index> supplied_tags)
{
  auto& supplied = model.water_field.supplied;
  supplied.assign(model.mesh.points.size(), 0);
  for (Index tag : supplied_tags)
  {
    const std::vector<double> on_facet = nodes_on_facets(model.mesh, model.exchange, tag);
    for (std::size_t i = 0; i < supplied.size(); ++i)
      supplied[i] |= on_facet[i] > 0;
  }
  std::map<Index, ImperviousNode<G::dim>> by_node;
  for (Index tag : facet_tags)
  {
    const auto normals = nodal_normals(model.mesh, model.exchange, tag);
    for (Index i = 0; i < model.mesh.n_nodes(); ++i)
      if (normals[i].area > 0)
      {
        by_node[i].node = i;
        add_directions<G::dim>(normals[i], by_node[i]);
      }
  }
  for (Index i = 0; G::has_hoop && i < model.mesh.n_nodes(); ++i)
    if (model.mesh.points[i][0] == 0)
    {
      by_node[i].node = i;
      add_direction<G::dim>({1}, by_node[i]);
    }
  for (const DashpotNode<G::dim>& entry : model.fields.front().dashpots)
    for (int a = 0; entry.is_rigid && a < G::dim; ++a)
    {
      Vector<G::dim> axis{};
      axis[a] = 1;
      by_node[entry.node].node = entry.node;
      add_direction<G::dim>(axis, by_node[entry.node]);
    }
  WaterField<G>& water = model.water_field;
  water.impervious.clear();
  for (const auto& [node, impervious] : by_node)
    water.impervious.push_back(impervious);
  water.closed = water.impervious;
}

template void add_direction<2>(Vector<2>, ImperviousNode<2>&);
template void add_direction<3>(Vector<3>, ImperviousNode<3>&);
#define INSTANTIATE(G) template void set_impervious(Model<G>&, std::span<const Index>, std::span<const Index>);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
