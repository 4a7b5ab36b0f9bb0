#include "model/contacts.h"

#include "contact/collisions.h"

namespace mpm::model
{
template <class G>
void begin_contacts(Model<G>& model, const TimeStep& step)
{
  for (auto& contact : model.contacts)
    begin_step(model.mesh, step, contact);
}

template <class G>
void sum_reactions(Model<G>& model)
{
  constexpr int D = G::dim;
  std::vector<Contact<D>*> moved;
  std::vector<Reaction<D>> sums;
  for (auto& contact : model.contacts)
    if (needs_reaction(contact.body))
    {
      moved.push_back(&contact);
      sums.push_back(contact.reaction);
    }
  static_assert(sizeof(Reaction<D>) % sizeof(double) == 0);
  if (moved.empty())
    return;
  const auto count = static_cast<int>(sums.size() * (sizeof(Reaction<D>) / sizeof(double)));
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), count, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  for (std::size_t k = 0; k < moved.size(); ++k)
    moved[k]->of_ranks = sums[k];
}

template <class G>
void end_contacts(Model<G>& model, const TimeStep& step)
{
  if (model.contacts.empty())
    return;
  sum_reactions(model);
  const auto gravity = gravity_at(model, step.start);
  for (auto& contact : model.contacts)
    accelerate<G::dim>(step, gravity, contact);
  resolve_collisions(model.collisions, model.contacts);
  for (auto& contact : model.contacts)
    end_step(step.dt, contact);
}

template <class G>
void add_contact_forces(Model<G>& model, double dt, VelocityField<G>& field)
{
  if (model.contacts.empty())
    return;
  const Movers movers{model.field_of_law, static_cast<Index>(&field - model.fields.data())};
  auto& forces = field.contact_force;
  forces.resize(field.nodes.size());
  bool touched = model.exchange.size > 1;
  for (auto& contact : model.contacts)
    touched |= add_contact_forces<G, G::dim>(model.mesh, model.order.runs, movers, field.start_velocity, dt,
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
  template void sum_reactions(Model<G>&);                                                                              \
  template void end_contacts(Model<G>&, const TimeStep&);                                                              \
  template void add_contact_forces(Model<G>&, double, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
