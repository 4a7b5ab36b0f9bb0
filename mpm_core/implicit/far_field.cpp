#include "implicit/far_field.h"

#include "model/far_field.h"

namespace mpm::implicit
{
template <class G, int D>
void add_border_forces(const NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step,
                       std::vector<NodalForces<D>>& forces)
{
  const FarField<D>& far = field.far_field;
  const auto springs = border_forces(far, border_values<D>(exchange, far, field.velocity, step.dt));
  for (std::size_t k = 0; k < springs.size(); ++k)
    for (int a = 0; a < D; ++a)
      forces[static_cast<std::size_t>(far.nodes[k])].external[a] -= springs[k][a];
}

template <int D>
void add_border_entries(const FarField<D>& far, const ImplicitSystem<D>& system, TangentSum<D>& tangent)
{
  const std::size_t width = far.size * D;
  for (std::size_t k = 0; k < far.nodes.size(); ++k)
    for (std::size_t l = 0; l < far.size; ++l)
    {
      Matrix<D> block;
      for (std::size_t a = 0; a < D; ++a)
        for (std::size_t b = 0; b < D; ++b)
          block[a][b] = far.stiffness[(k * D + a) * width + l * D + b];
      tangent.add_numbered(system.border[far.numbers[k]], system.border[l], block);
    }
}

template void add_border_entries(const FarField<2>&, const ImplicitSystem<2>&, TangentSum<2>&);
template void add_border_entries(const FarField<3>&, const ImplicitSystem<3>&, TangentSum<3>&);
#define INSTANTIATE(G)                                                                                                 \
  template void add_border_forces(const NodeExchange&, const VelocityField<G>&, const ImplicitStep<G>&,                \
                                  std::vector<NodalForces<G::dim>>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
