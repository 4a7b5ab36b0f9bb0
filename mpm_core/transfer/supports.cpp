#include "transfer/supports.h"

#include <cmath>
#include <map>

namespace mpm::transfer
{
namespace
{
/// Adds v . normal = value to the support of a node, by Gram-Schmidt.
template <int D>
void add(Support<D>& support, Vector<D> normal, double value, Index facet_tag)
{
  const double length = norm<D>(normal);
  for (int i = 0; i < D; ++i)
    normal[i] /= length;
  value /= length;
  for (int k = 0; k < support.count; ++k)
  {
    const double along = dot<D>(support.direction[k], normal);
    for (int i = 0; i < D; ++i)
      normal[i] -= along * support.direction[k][i];
    value -= along * support.value[k];
  }
  const double rest = norm<D>(normal);
  if (rest < 1e-9)
  {
    if (std::abs(value) > 1e-9 * (1 + std::abs(support.value[0])))
      throw InputError("supports: facet tag " + std::to_string(facet_tag) +
                       " prescribes a velocity that contradicts another support at the same node");
    return;
  }
  for (int i = 0; i < D; ++i)
    normal[i] /= rest;
  support.direction[support.count] = normal;
  support.value[support.count++] = value / rest;
}
} // namespace

template <int D>
std::vector<double> nodes_on_facets(const Mesh<D>& mesh, NodeExchange& exchange, Index facet_tag)
{
  std::vector<double> on_facet(mesh.points.size(), 0.0);
  for (Index c = 0; c < mesh.n_cells(); ++c)
    for (int k = 0; k <= D; ++k)
      if (mesh.facet_tags[c][k] == facet_tag)
        for (Index node : facet_nodes<D>(mesh.cells[c], k))
          on_facet[static_cast<std::size_t>(node)] = 1;
  sum_shared(exchange, on_facet.data(), 1);
  return on_facet;
}

template <class G>
std::vector<Support<G::dim>> make_supports(const Mesh<G::dim>& mesh, NodeExchange& exchange,
                                           std::span<const SupportRequest<G::dim>> requests)
{
  constexpr int D = G::dim;
  std::map<Index, Support<D>> by_node;
  for (const auto& request : requests)
  {
    if (!request.whole && !(norm<D>(request.vector) > 0))
      throw InputError("normal of the roller on facet tag " + std::to_string(request.facet_tag) +
                       " has no length, expected a direction");
    const std::vector<double> on_facet = nodes_on_facets(mesh, exchange, request.facet_tag);
    for (Index node = 0; node < mesh.n_nodes(); ++node)
    {
      if (on_facet[node] == 0)
        continue;
      Support<D>& support = by_node[node];
      support.node = node;
      for (int i = 0; i < (request.whole ? D : 1); ++i)
      {
        Vector<D> normal = request.vector;
        if (request.whole)
        {
          if (std::isnan(request.vector[i]))
            continue;
          normal = {};
          normal[i] = 1;
        }
        add<D>(support, normal, request.whole ? request.vector[i] : 0.0, request.facet_tag);
      }
    }
  }
  if constexpr (G::has_hoop)
    for (Index node = 0; node < mesh.n_nodes(); ++node)
      if (mesh.points[node][0] == 0)
      {
        by_node[node].node = node;
        add<D>(by_node[node], {1, 0}, 0, none);
      }
  std::vector<Support<D>> supports;
  supports.reserve(by_node.size());
  for (const auto& [node, support] : by_node)
    supports.push_back(support);
  return supports;
}

template std::vector<double> nodes_on_facets(const Mesh<2>&, NodeExchange&, Index);
template std::vector<double> nodes_on_facets(const Mesh<3>&, NodeExchange&, Index);
template std::vector<Support<2>> make_supports<PlaneStrain>(const Mesh<2>&, NodeExchange&,
                                                            std::span<const SupportRequest<2>>);
template std::vector<Support<2>> make_supports<Axisymmetric>(const Mesh<2>&, NodeExchange&,
                                                             std::span<const SupportRequest<2>>);
template std::vector<Support<3>> make_supports<Solid>(const Mesh<3>&, NodeExchange&,
                                                      std::span<const SupportRequest<3>>);
} // namespace mpm::transfer
