#include "model/contacts.h"

namespace mpm::model
{
template <class G>
void begin_contacts(Model<G>& model, const TimeStep& step)
{
  for (auto& contact : model.contacts)
    begin_step(model.mesh, step, contact);
}

template <class G>
void add_contact_forces(Model<G>& model, const TimeStep& step, VelocityField<G>& field)
{
  if (model.contacts.empty())
    return;
  const Movers movers{model.field_of_law, static_cast<Index>(&field - model.fields.data())};
  auto& forces = field.contact_force;
  forces.resize(field.nodes.size());
  bool touched = model.exchange.size > 1;
  for (auto& contact : model.contacts)
    touched |= add_contact_forces<G, G::dim>(model.mesh, model.order.runs, movers, field.start_velocity, step,
                                             model.particles, contact, forces);
  if (!touched)
    return;
  sum_shared(model.exchange, forces);
  for (Index i : field.part.nodes)
  {
    for (int a = 0; a < G::dim; ++a)
      field.nodes[i].traction[a] += forces[i][a];
    forces[i] = {};
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void begin_contacts(Model<G>&, const TimeStep&);                                                            \
  template void add_contact_forces(Model<G>&, const TimeStep&, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
