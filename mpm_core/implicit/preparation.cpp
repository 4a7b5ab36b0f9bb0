#include "implicit/preparation.h"

#include "implicit/inertia.h"
#include "implicit/nodal_stiffness.h"
#include "model/mapping.h"

#include <algorithm>

namespace mpm::implicit
{
template <class G>
void find_active(const Mesh<G::dim>& mesh, NodeExchange& exchange, const VelocityField<G>& field, ImplicitStep<G>& step)
{
  std::vector<double> filled(mesh.points.size(), 0.0);
  step.cells.clear();
  for (Index c = 0; c < mesh.owned_cells; ++c)
    if (field.moments[c].volume > 0)
    {
      step.cells.push_back(c);
      for (Index node : mesh.cells[c])
        filled[node] = 1;
    }
  sum_shared(exchange, filled.data(), 1);
  step.active.resize(filled.size());
  std::ranges::transform(filled, step.active.begin(), [](double f) { return f > 0 ? 1 : 0; });
}

template <class G>
void find_start_of_light_nodes(const Mesh<G::dim>& mesh, NodeExchange& exchange, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  std::vector<Vector<D + 1>> sums(mesh.points.size()); // of velocities, and how many
  for_each_light_vertex(mesh, field, field.start_velocity,
                        [&](Index node, const Vector<D>& mean)
                        {
                          for (int a = 0; a < D; ++a)
                            sums[node][a] += mean[a];
                          sums[node][D] += 1;
                        });
  sum_shared(exchange, sums);
  for (std::size_t i = 0; i < sums.size(); ++i)
    for (int a = 0; a < D && sums[i][D] > 0; ++a)
      field.start_velocity[i][a] = sums[i][a] / sums[i][D];
  for (const Support<D>& support : field.supports)
    impose<D>(support, field.start_velocity[support.node]);
}

template <class G>
void find_frequencies(const Mesh<G::dim>& mesh, NodeExchange& exchange, const MaterialPoints<G::dim>& points,
                      const VelocityField<G>& field, ImplicitStep<G>& step)
{
  step.elastic = nodal_stiffness(mesh, points, &WaveModuli::p_wave);
  step.frequency.assign(field.nodes.size(), 0.0);
  if (step.options.damping == 0)
    return;
  auto stiffness = nodal_stiffness(mesh, points, &WaveModuli::shear);
  sum_shared(exchange, stiffness.data(), 1);
  step.frequency = shear_frequencies<G::dim>(stiffness, field.nodes);
}

template <class G>
void make_halos_once(const Mesh<G::dim>& mesh, const NodeExchange& exchange, ImplicitStep<G>& step)
{
  if (exchange.size > 1 && !step.halos_ready)
    step.halos = make_halos(mesh, exchange.comm);
  step.halos_ready = true;
}
#define INSTANTIATE(G)                                                                                                 \
  template void find_active(const Mesh<G::dim>&, NodeExchange&, const VelocityField<G>&, ImplicitStep<G>&);            \
  template void find_start_of_light_nodes(const Mesh<G::dim>&, NodeExchange&, VelocityField<G>&);                      \
  template void find_frequencies(const Mesh<G::dim>&, NodeExchange&, const MaterialPoints<G::dim>&,                    \
                                 const VelocityField<G>&, ImplicitStep<G>&);                                           \
  template void make_halos_once(const Mesh<G::dim>&, const NodeExchange&, ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
