#include "model/field_contact_work.h"

#include "model/contact_pair.h"
#include "model/mapping.h"

namespace mpm::model
{
namespace
{
/// Work of forces on both bodies on a shift of the two.
/// @param f1, f2  forces on the first and the second body [N]
template <class G>
double work_on_shift(const Pair<G>& pair, const Vector<G::dim>& shift, const Vector<G::dim>& f1,
                     const Vector<G::dim>& f2)
{
  return dot<G::dim>(f2, mobility(pair.second, pair.node, shift)) -
         dot<G::dim>(f1, mobility(pair.first, pair.node, shift));
}

/// Velocity of the first body at a node relative to that of the second, at the step's start.
template <class G>
Vector<G::dim> start_velocities(const Model<G>& model, const FieldContact<G::dim>& contact,
                                const ContactNode<G::dim>& at)
{
  return difference<G::dim>(field_at(model, contact.first).start_velocity[at.node],
                            field_at(model, contact.second).start_velocity[at.node]);
}
} // namespace

template <class G>
void note_shift_work(Model<G>& model)
{
  constexpr int D = G::dim;
  for (const FieldContact<D>& contact : model.field_contacts)
  {
    const VelocityField<G>&first = field_at(model, contact.first), &second = field_at(model, contact.second);
    for (const ContactNode<D>& at : contact.touching)
      if (model.exchange.owned[at.node] && !is_light(first, at.node) && !is_light(second, at.node))
        model.totals.friction_work -=
            0.5 * work_on_shift(Pair<G>{first, second, at.node}, at.shift, first.nodes[at.node].internal,
                                second.nodes[at.node].internal);
  }
}

template <class G>
void note_late_work(Model<G>& model)
{
  note_shift_work(model);
  for (const FieldContact<G::dim>& contact : model.field_contacts)
    for (const ContactNode<G::dim>& at : contact.touching)
      if (model.exchange.owned[at.node])
        model.totals.friction_work += 0.5 * contact.dt * dot<G::dim>(at.force, start_velocities(model, contact, at));
}

template <class G>
void note_field_contact_work(Model<G>& model, double dt, bool late)
{
  constexpr int D = G::dim;
  const Vector<D> gravity = gravity_at(model, model.time);
  double taken = 0, dissipated = 0;
  for (const FieldContact<D>& contact : model.field_contacts)
  {
    const VelocityField<G>&first = field_at(model, contact.first), &second = field_at(model, contact.second);
    for (const ContactNode<D>& at : contact.touching)
    {
      if (!model.exchange.owned[at.node])
        continue;
      const Pair<G> pair{first, second, at.node};
      const Vector<D> start = start_velocities(model, contact, at);
      const Vector<D> end = difference<D>(first.velocity[at.node], second.velocity[at.node]);
      const Vector<D> f1 = sum<D>(unbalanced_force<D>(first.nodes[at.node], gravity), 1, at.force);
      const Vector<D> f2 = sum<D>(unbalanced_force<D>(second.nodes[at.node], gravity), -1, at.force);
      taken += 0.5 * dt * dot<D>(at.force, sum<D>(start, 1, end));
      dissipated += 0.5 * dt * dot<D>(at.force, late ? start : sum<D>(start, 1, end));
      dissipated += 0.5 * (work_on_shift(pair, at.shift, f1, f2) + dot<D>(at.force, pair.change(at.shift)));
    }
  }
  model.totals.external_work += taken; // the nodes' works have it with the opposite sign
  model.totals.friction_work += dissipated;
}

#define INSTANTIATE(G)                                                                                                 \
  template void note_shift_work(Model<G>&);                                                                            \
  template void note_late_work(Model<G>&);                                                                             \
  template void note_field_contact_work(Model<G>&, double, bool);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
