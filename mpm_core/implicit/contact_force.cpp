#include "implicit/contact_force.h"

#include "contact/clearance.h"
#include "contact/touch.h"
#include "contact/water_share.h"
#include "implicit/driven_bodies.h"
#include "implicit/pore_water.h"
#include "model/contacts.h"
#include "model/material_points.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
namespace
{
template <int D>
Vector<D> slip_of(const std::vector<Column>* slips, Index p)
{
  Vector<D> slip{};
  for (std::size_t i = 0; slips && i < D; ++i)
    slip[i] = (*slips)[i][p];
  return slip;
}

/// Springs carry the pressure of the pore water, too, also where the soil has hardly any stiffness of its own: a
/// particle sinks in by a hundredth of its radius then.
template <int D>
ContactModuli with_water(const ContactModuli& of_soil, const Particles<D>& particles, Index p)
{
  constexpr double least = 20;
  const double pressure = particles.pore_pressure[0].empty() ? 0 : std::abs(particles.pore_pressure[0][p]);
  return {std::max(of_soil.compression, least * pressure), std::max(of_soil.shear, least * pressure)};
}

/// The particles of a run that touch a surface when the nodes move with a velocity over a time.
template <class G, int D = G::dim>
void find_touching(const Model<G>& model, SeenSurface<D> seen, const std::vector<Column>* slips, const Run& run,
                   const ContactModuli& of_soil, const std::vector<Column>* bonds, std::span<const Vector<D>> velocity,
                   double dt, double volumetric, bool tangents, TrialContact<D>& trial)
{
  const auto nodal = [velocity](Index i) -> const Vector<D>& { return velocity[static_cast<std::size_t>(i)]; };
  const AffineField<D> field = affine_field<D>(model.mesh, run.cell, nodal);
  for (Index p = run.first; p < run.last; ++p)
  {
    if (bonds && !is_tied(*bonds, p))
      continue;
    const ContactModuli moduli = with_water(of_soil, model.particles, p);
    const Vector<D> x = at<D>(model.particles.position, p);
    const Vector<D> xi = difference<D>(x, model.mesh.shapes[run.cell].centre);
    Vector<D> u;
    for (int i = 0; i < D; ++i)
      u[i] = dt * (field.value[i] + dot<D>(field.gradient[i], xi));
    TouchingParticle<D> found{p,  static_cast<Index>(run.cell),
                              {}, spring_of<G>(model.particles, p, moduli, seen.contact.penalty),
                              {}, radius_at_end<G>(model.particles, p, volumetric, u),
                              u,  {}};
    bool touches = bonds;
    if (bonds)
      found.touch = tied_at_end<D>(seen, trial.end, found.spring, x, u, anchor_of<D>(*bonds, p));
    else
      touches = touches_at_end<D>(seen, trial.end, found.spring, found.water, found.radius.value, x, u,
                                  slip_of<D>(slips, p), tangents, found.touch);
    if (!touches)
      continue;
    const Vector<D> edge = bonds ? x : edge_at_start<D>(seen, particle_radius<G>(model.particles, p), x);
    found.share = weights_at<D>(model.mesh.shapes[run.cell], edge);
    trial.touching.push_back(found);
  }
}

/// Pore pressure at a point of a surface beside the soil of a cell, less that of standing water. No water flows through
/// the surface, so that across it the pressure has the gradient of the water's weight.
template <class G>
double pressure_at_surface(const Model<G>& model, const ImplicitStep<G>& step, Index cell, const Vector<G::dim>& point,
                           const Vector<G::dim>& normal)
{
  constexpr int D = G::dim;
  const PoreStep<D>& pore = step.pore;
  const CellMoments<G>& moments = model.fields.front().moments[cell];
  double distance = 0, gradient = 0; // of the middle of the soil, and along the normal
  for (int a = 0; a < D; ++a)
  {
    distance += (model.mesh.shapes[cell].centre[a] + moments.mass_xi[a] / moments.mass - point[a]) * normal[a];
    gradient += (pore.density * pore.gravity[a] - pore.cells[cell].load.gradient[a]) * normal[a];
  }
  return pressure_sum(model.mesh, step, cell) / volume_of(pore.cells[cell]) - distance * gradient;
}

/// Normal forces and areas of the particles that touch a surface at the nodes, of this rank.
template <class G, int D = G::dim>
std::vector<PressedNode<D>> pressed_nodes(const Model<G>& model, const TrialContact<D>& trial)
{
  std::vector<PressedNode<D>> nodes(model.mesh.points.size(), PressedNode<D>{});
  for (const TouchingParticle<D>& at_surface : trial.touching)
  {
    const EndTouch<D>& touch = at_surface.touch;
    if (!touch.presses)
      continue;
    const auto weights =
        weights_at<D>(model.mesh.shapes[at_surface.cell], at<D>(model.particles.position, at_surface.particle));
    for (int k = 0; k <= D; ++k)
    {
      PressedNode<D>& node = nodes[model.mesh.cells[at_surface.cell][k]];
      node.area += weights[k] * touch.area;
      for (int a = 0; a < D; ++a)
        node.force[a] += weights[k] * at_surface.spring.stiffness * touch.depth * touch.normal[a];
    }
  }
  return nodes;
}

/// Takes from the friction of a surface what the pore water carries of the normal forces.
/// @note Collective
template <class G, int D = G::dim>
void share_with_water(Model<G>& model, const ImplicitStep<G>& step, double travelled, bool tangents,
                      const Contact<D>& contact, TrialContact<D>& trial)
{
  const Mesh<D>& mesh = model.mesh;
  const std::vector<double> areas =
      contact::areas_per_force<D>(mesh, model.exchange, step.cells, step.pore.around, pressed_nodes(model, trial));
  const auto* slips = columns_of(model.particles, contact.slip);
  for (auto& [p, cell, touch, spring, water, radius, u, share] : trial.touching)
  {
    const Vector<D> x = at<D>(model.particles.position, p);
    const auto weights = weights_at<D>(mesh.shapes[cell], x);
    water.per_pressure = 0;
    for (int k = 0; k <= D; ++k)
      water.per_pressure += weights[k] * areas[mesh.cells[cell][k]];
    Vector<D> point = touch.arm;
    for (int a = 0; a < D; ++a)
      point[a] += contact.body.centre[a] + trial.end.displacement[a];
    water.fraction = water.per_pressure * pressure_at_surface<G>(model, step, cell, point, touch.normal);
    SeenSurface<D> seen = seen_from(contact, cell, travelled + norm<D>(u));
    touches_at_end<D>(seen, trial.end, spring, water, radius.value, x, u, slip_of<D>(slips, p), tangents, touch);
  }
}

/// Adds the derivatives of the force on a particle to those of all that touch in its cell.
template <class G, int D = G::dim>
void add_derivatives(const Model<G>& model, const TouchingParticle<D>& at_surface, const PoreStep<D>& pore,
                     CellContact<D>& in_cell)
{
  const EndTouch<D>& touch = at_surface.touch;
  const Index cell = at_surface.cell;
  const auto& share = at_surface.share;
  const auto weights = weights_at<D>(model.mesh.shapes[cell], at<D>(model.particles.position, at_surface.particle));
  Matrix<D> stiffness = touch.stiffness;
  for (int i = 0; i < D; ++i)
    stiffness[i][0] -= touch.by_radius[i] * at_surface.radius.by_motion;
  for (std::size_t k = 0; k <= D; ++k)
    for (int i = 0; i < D; ++i)
    {
      in_cell.by_volumetric[k][i] -= share[k] * touch.by_radius[i] * at_surface.radius.by_volumetric;
      for (std::size_t l = 0; l <= D; ++l)
        for (int j = 0; j < D; ++j)
          in_cell.blocks[k][l][i][j] += share[k] * weights[l] * stiffness[i][j];
    }
  for (int l = 0; l <= D && pore.flows; ++l)
  {
    const double by_node = pressure_by_node(pore, cell, l) / volume_of(pore.cells[cell]);
    for (int k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        in_cell.by_water[k][l][a] += share[k] * touch.by_water[a] * by_node;
  }
}

/// Adds the particles' forces, and their blocks, to the nodes of their cells.
template <class G, int D = G::dim>
void scatter(const Model<G>& model, std::span<const TouchingParticle<D>> particles, bool tangents,
             const PoreStep<D>& pore, ContactStep<D>& step)
{
  for (const TouchingParticle<D>& at_surface : particles)
  {
    const Index cell = at_surface.cell;
    for (std::size_t k = 0; k <= D; ++k)
      for (int i = 0; i < D; ++i)
        step.forces[static_cast<std::size_t>(model.mesh.cells[cell][k])][i] +=
            at_surface.share[k] * at_surface.touch.force[i];
    if (!tangents)
      continue;
    if (step.number_of_cell[cell] == none)
    {
      step.number_of_cell[cell] = static_cast<Index>(step.cells.size());
      step.cells.push_back({});
    }
    add_derivatives<G>(model, at_surface, pore, step.cells[static_cast<std::size_t>(step.number_of_cell[cell])]);
  }
}

/// Finds what touches all surfaces under the iterate, and the forces at nodes.
/// @note Collective where there is pore water
template <class G, int D = G::dim>
void find_contacts(Model<G>& model, bool tangents, ImplicitStep<G>& step)
{
  const std::span<const Vector<D>> velocity = model.fields.front().velocity;
  const TimeStep time{step.time, step.dt};
  ContactStep<D>& found = step.contact;
  found.surfaces.resize(model.contacts.size());
  found.forces.assign(model.mesh.points.size(), {});
  found.cells.clear();
  found.number_of_cell.assign(static_cast<std::size_t>(model.mesh.owned_cells), none);
  for (std::size_t k = 0; k < model.contacts.size(); ++k)
  {
    Contact<D>& contact = model.contacts[k];
    keep_clearance<D>(model.mesh, contact);
    TrialContact<D>& trial = found.surfaces[k];
    trial.end = body_at_end<D>(contact, time, step.options.at_rest, driven_motion<D>(step.bodies, k));
    trial.touching.clear();
    const auto* slips = columns_of(model.particles, contact.slip);
    const auto* tied = columns_of(model.particles, contact.bond);
    const double travelled = contact.travel + step_travel(contact, trial.end, time.dt);
    const bool wet = !step.pore.cells.empty() && has_friction(contact);
    for (const Run& run : model.order.runs)
    {
      const auto cell = static_cast<std::size_t>(run.cell);
      const double gap = contact.bounds[cell].distance - contact.bounds[cell].reach - travelled;
      const Extremes extremes = extremes_of<G, D>(model.mesh, run, velocity, time.dt, model.particles);
      if (!may_be_near<D>(extremes, gap))
        continue;
      const SeenSurface<D> seen = seen_from(contact, static_cast<Index>(run.cell), travelled + extremes.motion);
      find_touching<G, D>(model, seen, slips, run, found.moduli[cell], tied, velocity, time.dt,
                          step.strains[cell].volumetric, tangents && !wet, trial);
    }
    if (wet)
      share_with_water(model, step, travelled, tangents, contact, trial);
    scatter<G, D>(model, trial.touching, tangents, step.pore, found);
  }
}
} // namespace

template <class G>
void start_contacts(const Model<G>& model, ImplicitStep<G>& step)
{
  step.contact.moduli.clear();
  if (!model.contacts.empty())
    for (const WaveModuli& of_cell : moduli_of_cells(material_points(model), model.mesh.owned_cells))
      step.contact.moduli.push_back({of_cell.p_wave, of_cell.shear});
}

template <class G>
void try_contacts(Model<G>& model, bool tangents, ImplicitStep<G>& step)
{
  if (model.contacts.empty())
    step.contact = {};
  else
    find_contacts<G>(model, tangents, step);
}

template <class G, int D>
void add_contact_forces(const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces)
{
  for (std::size_t i = 0; i < step.contact.forces.size(); ++i)
    for (int a = 0; a < D; ++a)
      forces[i].external[a] += step.contact.forces[i][a];
}

template <class G, int D>
void add_contact_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step, TangentSum<D>& tangent)
{
  if (step.contact.surfaces.empty())
    return;
  static constexpr CellContact<D> nothing{};
  for (Index c : step.cells) // also those where nothing touches, so that the order of entries is always the same
  {
    const CellContact<D>* in_cell = step.contact.in(c);
    const auto& [blocks, by_volumetric, by_water] = in_cell ? *in_cell : nothing;
    for (std::size_t l = 0; l <= D; ++l)
    {
      const Vector<D> dilates =
          step.options.nmd ? Vector<D>{} : dilation_gradient<G>(mesh.shapes[c], static_cast<int>(l));
      for (std::size_t k = 0; k <= D; ++k)
      {
        Matrix<D> block = blocks[k][l];
        for (int i = 0; i < D; ++i)
          for (int j = 0; j < D; ++j)
            block[i][j] += by_volumetric[k][i] * dilates[j];
        tangent.add(mesh.cells[c][k], mesh.cells[c][l], block);
        if (step.pore.flows)
          tangent.add_coupled(mesh.cells[c][k], mesh.cells[c][l],
                              column_of_pressure<D>(step.pore, mesh.cells[c][l], by_water[k][l]), {}, 0);
      }
    }
  }
}

template <class G>
void keep_slip(Model<G>& model, const ImplicitStep<G>& step)
{
  constexpr int D = G::dim;
  for (std::size_t k = 0; k < model.contacts.size(); ++k)
  {
    Contact<D>& contact = model.contacts[k];
    Reaction<D>& reaction = contact.reaction = {};
    auto* slips = columns_of(model.particles, contact.slip);
    for (std::size_t i = 0; slips && i < D; ++i)
      std::ranges::fill((*slips)[i], 0.0);
    for (const auto& [p, cell, touch, spring, water, radius, u, share] : step.contact.surfaces[k].touching)
    {
      for (std::size_t i = 0; slips && i < D; ++i)
        (*slips)[i][p] = touch.slip[i];
      if (contact.bond.empty() && touch.presses && !(touch.depth > 0))
        continue;
      react<D>(touch.force, touch.arm, reaction);
      reaction.normal += dot<D>(touch.force, touch.normal);
      reaction.area += touch.covered;
      reaction.sticking += (slips || !contact.bond.empty()) && touch.sticks ? touch.covered : 0;
      reaction.mass += model.particles.mass[p];
      reaction.pressing += touch.presses ? model.particles.mass[p] : 0;
      const double slips_by = contact.bond.empty() ? spring.shear : spring.stiffness;
      reaction.energy +=
          0.5 * (spring.stiffness * touch.depth * touch.depth + slips_by * dot<D>(touch.slip, touch.slip));
    }
  }
}

template <class G>
void keep_contact_forces(ImplicitStep<G>& step)
{
  for (auto& trial : step.contact.surfaces)
  {
    Reaction<G::dim> reaction;
    for (const auto& at_surface : trial.touching)
      react<G::dim>(at_surface.touch.force, at_surface.touch.arm, reaction);
    trial.before = reaction.force;
  }
}

template <class G>
void move_bodies(Model<G>& model, const ImplicitStep<G>& step)
{
  sum_reactions(model);
  for (std::size_t k = 0; k < model.contacts.size(); ++k)
  {
    auto& contact = model.contacts[k];
    contact.body = step.contact.surfaces[k].end;
    contact.travel += step_travel(contact, contact.body, step.length);
    if (step.options.quasi_static)
      stop_driven(contact.body);
    const auto& before = step.contact.surfaces[k].before;
    const double weight = step.stage.weight; // 1 in steps of first order
    for (int i = 0; i < G::dim; ++i)
      contact.impulse[i] += step.length * (weight * contact.reaction.force[i] + (1 - weight) * before[i]);
  }
}

template <class G>
void add_contact_tractions(Model<G>& model, const ImplicitStep<G>& step)
{
  if (model.contacts.empty())
    return;
  VelocityField<G>& field = model.fields.front();
  auto forces = step.contact.forces;
  sum_shared(model.exchange, forces);
  for (Index i : field.part.nodes)
    for (int a = 0; a < G::dim; ++a)
      field.nodes[i].traction[a] += forces[static_cast<std::size_t>(i)][a];
}

#define INSTANTIATE(G)                                                                                                 \
  template void start_contacts(const Model<G>&, ImplicitStep<G>&);                                                     \
  template void try_contacts(Model<G>&, bool, ImplicitStep<G>&);                                                       \
  template void add_contact_forces(const ImplicitStep<G>&, std::vector<NodalForces<G::dim>>&);                         \
  template void add_contact_entries(const Mesh<G::dim>&, const ImplicitStep<G>&, TangentSum<G::dim>&);                 \
  template void keep_slip(Model<G>&, const ImplicitStep<G>&);                                                          \
  template void keep_contact_forces(ImplicitStep<G>&);                                                                 \
  template void move_bodies(Model<G>&, const ImplicitStep<G>&);                                                        \
  template void add_contact_tractions(Model<G>&, const ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
