#include "model/contacts.h"

#include "contact/clearance.h"
#include "contact/collisions.h"
#include "model/resting.h"
#include "transfer/resting.h"

#include <limits>

namespace mpm::model
{
template <class G>
double smallest_gap(const Model<G>& model, const Surface<G::dim>& surface)
{
  constexpr int D = G::dim;
  const Particles<D>& particles = model.particles;
  double gap = std::numeric_limits<double>::infinity();
  const auto look = [&](const Vector<D>& x, double volume)
  { gap = std::min(gap, distance<D>(surface, x).value - contact::radius_of<G>(volume, x[0])); };
  Rules<D> rules;
  for (Index p = 0; p < particles.size(); ++p)
  {
    if (!is_resting(particles, p))
    {
      look(at<D>(particles.position, p), particles.volume[p]);
      continue;
    }
    const Rule<D>& points = rule_of<D>(static_cast<int>(particles.resting[0][p]), rules);
    const std::vector<double> weights = rule_weights<G>(model.mesh, particles.cell[p], points);
    for (std::size_t k = 0; k < points.size(); ++k)
      look(point_in_cell<D>(model.mesh, particles.cell[p], points[k]), weights[k] * particles.volume[p]);
  }
  return gap;
}

template <class G>
void convert_near_surfaces(Model<G>& model, double ahead)
{
  constexpr int D = G::dim;
  if (model.contacts.empty() || !model.particles.resting.present)
    return;
  std::vector<unsigned char> chosen(static_cast<std::size_t>(model.mesh.owned_cells), 0);
  for (auto& contact : model.contacts)
  {
    keep_clearance<D>(model.mesh, contact);
    contact::RigidBody<D> body = contact.body;
    prescribe_motion(TimeStep{model.time, ahead}, contact.of_ranks, body);
    const double travel = step_travel(contact, body, ahead);
    const auto is_near = [&](Index cell)
    {
      contact::CellBound<D> bound = contact.bounds[static_cast<std::size_t>(cell)];
      if (!may_be_near(bound, contact.travel + travel))
        return false;
      // Bounds depend on when they were found; what is near does not.
      bound.distance = distance<D>(contact.surface, as_at_start<D>(contact.body, model.mesh.shapes[cell].centre)).value;
      return may_be_near(bound, travel);
    };
    for (Index p = 0; p < model.particles.size(); ++p)
      if (const Index cell = model.particles.cell[p]; is_resting(model.particles, p) && is_near(cell))
        chosen[static_cast<std::size_t>(cell)] = 1;
  }
  convert_cells<G>(model, chosen);
}

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
  template double smallest_gap(const Model<G>&, const Surface<G::dim>&);                                               \
  template void convert_near_surfaces(Model<G>&, double);                                                              \
  template void begin_contacts(Model<G>&, const TimeStep&);                                                            \
  template void sum_reactions(Model<G>&);                                                                              \
  template void end_contacts(Model<G>&, const TimeStep&);                                                              \
  template void add_contact_forces(Model<G>&, double, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
