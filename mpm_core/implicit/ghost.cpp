#include "implicit/ghost.h"

namespace mpm::implicit
{
template <class G, int D>
void add_ghost_forces(const VelocityField<G>& field, const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces)
{
  const double inertia = step.options.quasi_static ? 0 : 1 / step.stage.dt;
  for (const GhostFacet<D>& facet : step.ghosts)
  {
    const Vector<D> jump =
        jump_over(facet,
                  [&](Index i)
                  {
                    Vector<D> value;
                    for (int a = 0; a < D; ++a)
                      value[a] = facet.stiffness * step.dt * (field.velocity[i][a] - field.start_velocity[i][a]) +
                                 facet.mass * inertia * (end_velocity(step, field, i, a) - step.stage.start[i][a]);
                    return value;
                  });
    for (int k = 0; k < D + 2; ++k)
      for (int a = 0; a < D; ++a)
        forces[facet.nodes[k]].ghost[a] += facet.fraction[k] * facet.jump[k] * jump[a];
  }
}

template <class G, int D>
void add_ghost_entries(const ImplicitStep<G>& step, TangentSum<D>& tangent)
{
  for (const GhostFacet<D>& facet : step.ghosts)
  {
    const double factor =
        facet.stiffness + (step.options.quasi_static ? 0 : facet.mass / (step.stage.weight * step.stage.dt * step.dt));
    for (int k = 0; k < D + 2; ++k)
      for (int l = 0; l < D + 2; ++l)
      {
        if (facet.fraction[k] == 0)
          continue;
        Matrix<D> block{};
        for (int a = 0; a < D; ++a)
          block[a][a] = facet.fraction[k] * factor * facet.jump[k] * facet.jump[l];
        tangent.add(facet.nodes[k], facet.nodes[l], block);
      }
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void add_ghost_forces(const VelocityField<G>&, const ImplicitStep<G>&, std::vector<NodalForces<G::dim>>&);  \
  template void add_ghost_entries(const ImplicitStep<G>&, TangentSum<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
