#include "contact/contact.h"

#include "contact/clearance.h"

#include <algorithm>
#include <cmath>

namespace mpm::contact
{
template <class G>
double radius_of(double volume, [[maybe_unused]] double x)
{
  if constexpr (G::dim == 3)
    return 0.5 * std::cbrt(volume);
  else if constexpr (G::has_hoop)
    return 0.5 * std::sqrt(volume / x);
  else
    return 0.5 * std::sqrt(volume);
}

template <class G>
double particle_radius(const Particles<G::dim>& particles, Index p)
{
  return radius_of<G>(particles.volume[p], particles.position[0][p]);
}

template <int D>
void begin_step(const Mesh<D>& mesh, const TimeStep& step, Contact<D>& contact)
{
  prescribe_motion(step, contact.of_ranks, contact.body);
  contact.reaction = {};
  // Steps may become shorter and longer, and a free body may meet more soil. A spring that grew stiffer under load
  // would make energy, so that this one only becomes softer, when it would be too stiff for the step.
  const double load = contact.of_ranks.load;
  if (contact.stiff_step == 0)
    contact.stiff_step = step.dt;
  contact.stiff_step = std::max(contact.stiff_step, std::sqrt(load > 0 ? 1 + load : contact.penalty) * step.dt);
  keep_clearance<D>(mesh, contact);
}

template <int D>
void accelerate(const TimeStep& step, const Vector<D>& gravity, Contact<D>& contact)
{
  for (int i = 0; i < D; ++i)
    contact.impulse[i] += step.dt * contact.reaction.force[i];
  accelerate_body<D>(step, gravity, contact.of_ranks, contact.body);
}

template <int D>
void end_step(double dt, Contact<D>& contact)
{
  move_body(dt, contact.body);
  contact.travel += step_travel(contact, contact.body, dt);
}

#define INSTANTIATE_STEP(D)                                                                                            \
  template void begin_step<D>(const Mesh<D>&, const TimeStep&, Contact<D>&);                                           \
  template void accelerate<D>(const TimeStep&, const Vector<D>&, Contact<D>&);                                         \
  template void end_step<D>(double, Contact<D>&);
INSTANTIATE_STEP(2)
INSTANTIATE_STEP(3)
#define INSTANTIATE(G)                                                                                                 \
  template double radius_of<G>(double, double);                                                                        \
  template double particle_radius<G>(const Particles<G::dim>&, Index);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::contact
