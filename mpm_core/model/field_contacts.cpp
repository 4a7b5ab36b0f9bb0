#include "model/field_contacts.h"

#include "model/contact_pair.h"
#include "model/field_contact_work.h"
#include "model/mapping.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::model
{
namespace
{
/// The velocity of a node at the step's end under the forces known so far, without local damping.
template <class G>
Vector<G::dim> trial_velocity(const VelocityField<G>& field, Index node, const Vector<G::dim>& gravity, double dt)
{
  constexpr int D = G::dim;
  const Vector<D> force = unbalanced_force<D>(field.nodes[node], gravity);
  Vector<D> velocity = field.start_velocity[node];
  for (int a = 0; a < D; ++a)
    velocity[a] += dt / field.nodes[node].mass * force[a];
  if (const Support<D>* support = support_of(field, node))
    impose<D>(*support, velocity);
  return velocity;
}

/// The impulse on the second body that keeps them from approaching by more than the gap, with Coulomb friction; finds
/// whether they stick.
/// @param relative  velocity of the first body less that of the second, at the step's end without contact
/// @param bond      largest tangential impulse without a normal one, by adhesion [N s]
template <class G>
Vector<G::dim> impulse_of(const Pair<G>& pair, const FieldContact<G::dim>& contact, ContactNode<G::dim>& at,
                          const Vector<G::dim>& relative, double bond, double dt)
{
  constexpr int D = G::dim;
  const double approach = dot<D>(relative, at.normal) - at.gap / dt, yielding = pair.mobility(at.normal, at.normal);
  double normal = approach > 0 && yielding > 0 ? approach / yielding : 0; // none where both are held along the normal
  const Vector<D> slip = sum<D>(relative, -dot<D>(relative, at.normal), at.normal);
  const double speed = norm<D>(slip);
  at.sticks = contact.friction * normal + bond > 0;
  if (!(speed > 0) || !at.sticks)
    return sum<D>({}, normal, at.normal);
  const Vector<D> along = sum<D>({}, 1 / speed, slip);
  const double tangential = pair.mobility(along, along);
  if (normal == 0)
  {
    at.sticks = speed <= bond * tangential;
    return sum<D>({}, tangential > 0 ? std::min(bond, speed / tangential) : 0, along);
  }
  // Impulses N along the normal and T along the slip act on both components of the velocity where a boundary condition
  // is inclined to the normal.
  const double across = pair.mobility(along, at.normal), determinant = yielding * tangential - across * across;
  double friction = determinant > 0 ? (yielding * speed - across * approach) / determinant : 0;
  if (determinant > 0)
    normal = (tangential * approach - across * speed) / determinant;
  at.sticks = friction <= contact.friction * normal + bond;
  if (!at.sticks)
  {
    normal = (approach - across * bond) / (yielding + contact.friction * across);
    friction = contact.friction * normal + bond;
  }
  if (!(normal > 0))
    return {};
  return sum<D>(sum<D>({}, normal, at.normal), friction, along);
}

/// The impulse on the second body that gives the bodies a relative velocity which contact leaves them: none where they
/// stick; along the normal they do not open, and do not approach beyond their gap. With the impulse of the step it does
/// not pull.
/// @param relative  velocity of the first body less that of the second
/// @param pressing  impulse of the step along the normal [N s]
template <class G>
Vector<G::dim> separation_of(const Pair<G>& pair, const ContactNode<G::dim>& at, const Vector<G::dim>& relative,
                             double pressing, double dt)
{
  constexpr int D = G::dim;
  Vector<D> impulse{};
  const Vector<D> slip = sum<D>(relative, -dot<D>(relative, at.normal), at.normal);
  const double speed = norm<D>(slip);
  if (at.sticks && speed > 0)
  {
    const Vector<D> along = sum<D>({}, 1 / speed, slip);
    const double tangential = pair.mobility(along, along);
    impulse = sum<D>({}, tangential > 0 ? speed / tangential : 0, along);
  }
  const double yielding = pair.mobility(at.normal, at.normal);
  if (!(yielding > 0))
    return impulse;
  const double approach = dot<D>(difference<D>(relative, pair.change(impulse)), at.normal);
  const double wrong = approach - std::clamp(approach, 0.0, at.gap / dt);
  return sum<D>(impulse, std::max(wrong / yielding, -pressing), at.normal);
}

/// The largest tangential impulse of adhesion at a node; zero where the bodies do not touch.
/// @param area  of the surface at the node [m2]
template <int D>
double bond_of(const FieldContact<D>& contact, double gap, double area, double dt)
{
  // Soil that waves go through opens gaps far smaller than its grains, which do not break a bond.
  constexpr double touching = 0.01; // of the width of the area
  const double width = D == 2 ? area : std::sqrt(area);
  return gap < touching * width ? contact.adhesion * area * dt : 0;
}

/// Finds the nodes that both bodies have, and the cells around them; resets what is found there.
template <class G, int D = G::dim>
void find_nodes_of_both(const Model<G>& model, FieldContact<D>& contact)
{
  const Mesh<D>& mesh = model.mesh;
  const VelocityField<G>&first = field_at(model, contact.first), &second = field_at(model, contact.second);
  ContactScratch<D>& scratch = contact.scratch;
  for (Index i : scratch.nodes)
    scratch.has_node[static_cast<std::size_t>(i)] = 0;
  for (Index c : scratch.cells)
    scratch.has_cell[static_cast<std::size_t>(c)] = 0;
  scratch.nodes.clear();
  scratch.cells.clear();
  scratch.has_node.resize(mesh.points.size());
  scratch.has_cell.resize(mesh.cells.size());
  for (Index i : first.part.nodes)
    if (second.part.has_node[i] && !is_light(first, i) && !is_light(second, i))
    {
      scratch.nodes.push_back(i);
      scratch.has_node[static_cast<std::size_t>(i)] = 1;
    }
  const auto is_near = [&](Index node) { return scratch.has_node[static_cast<std::size_t>(node)] != 0; };
  for (const MeshPart* part : {&first.part, &second.part})
    for (Index c : part->cells)
      if (!scratch.has_cell[static_cast<std::size_t>(c)] && std::ranges::any_of(mesh.cells[c], is_near))
      {
        scratch.cells.push_back(c);
        scratch.has_cell[static_cast<std::size_t>(c)] = 1;
      }
}

/// Gives the nodes that both bodies have, and those shared with other ranks, a value to start from.
template <class T>
void reset(std::vector<T>& values, const T& value, std::size_t n, std::span<const Index> nodes,
           const NodeExchange& exchange)
{
  values.resize(n, value);
  for (const std::span<const Index> each : {nodes, std::span<const Index>(exchange.shared_nodes)})
    for (Index i : each)
      values[static_cast<std::size_t>(i)] = value;
}

/// What the volume of a body in a cell is the measure of in the plane of the mesh: the sum of V grad N over the cells
/// is a surface there. In axial symmetry a volume is an area times the radius, and such a sum would have a part along
/// the radius beside the surface.
template <class G, int D = G::dim>
double in_plane(const VelocityField<G>& field, const Mesh<D>& mesh, Index cell)
{
  if constexpr (G::has_hoop)
    return field.moments[cell].volume / mesh.shapes[cell].centre[0];
  return field.moments[cell].volume;
}

/// At each node twice its area in the surface between the bodies, with the normal from the first to the second: the
/// difference of their sums of V grad N. That of a body which fills its cells is the integral of N times the outward
/// normal over its surface.
template <class G, int D = G::dim>
void find_areas(Model<G>& model, FieldContact<D>& contact)
{
  const Mesh<D>& mesh = model.mesh;
  const VelocityField<G>&first = field_at(model, contact.first), &second = field_at(model, contact.second);
  auto& areas = contact.scratch.areas;
  reset(areas, Vector<D>{}, mesh.points.size(), contact.scratch.nodes, model.exchange);
  for (Index c : contact.scratch.cells)
    for (int k = 0; k <= D; ++k)
    {
      const auto node = static_cast<std::size_t>(mesh.cells[c][k]);
      if (contact.scratch.has_node[node])
        areas[node] =
            sum<D>(areas[node], in_plane(first, mesh, c) - in_plane(second, mesh, c), mesh.shapes[c].gradient[k]);
    }
  sum_shared(model.exchange, areas);
}

/// How far the particles in the cells around each node reach along its normal.
template <class G, int D = G::dim>
void find_reaches(Model<G>& model, FieldContact<D>& contact)
{
  constexpr double none = -std::numeric_limits<double>::infinity();
  const Mesh<D>& mesh = model.mesh;
  const ContactScratch<D>& scratch = contact.scratch;
  auto& reaches = contact.scratch.reaches;
  reset(reaches, Reaches{none, none}, mesh.points.size(), scratch.nodes, model.exchange);
  for (const Run& run : model.order.runs)
  {
    const Index field = model.field_of_law[static_cast<std::size_t>(run.material)];
    if (!scratch.has_cell[static_cast<std::size_t>(run.cell)] || (field != contact.first && field != contact.second))
      continue;
    const double sign = field == contact.first ? 1 : -1;
    for (Index i : mesh.cells[run.cell])
    {
      const auto node = static_cast<std::size_t>(i);
      if (!scratch.has_node[node])
        continue;
      double& reach = field == contact.first ? reaches[node].first : reaches[node].second;
      for (Index p = run.first; p < run.last; ++p)
      {
        const Vector<D> arm = difference<D>(at<D>(model.particles.position, p), mesh.points[i]);
        reach = std::max(reach,
                         sign * dot<D>(arm, scratch.normals[node]) + contact::particle_radius<G>(model.particles, p));
      }
    }
  }
  max_shared(model.exchange, reaches);
}

/// The nodes where the bodies are in contact in this step, with their forces.
template <class G>
void find_forces(Model<G>& model, const Vector<G::dim>& gravity, double dt, FieldContact<G::dim>& contact)
{
  constexpr int D = G::dim;
  contact.touching.clear();
  contact.dt = dt;
  const VelocityField<G>&first = field_at(model, contact.first), &second = field_at(model, contact.second);
  ContactScratch<D>& scratch = contact.scratch;
  find_nodes_of_both(model, contact);
  scratch.normals.resize(model.mesh.points.size());
  for (Index i : scratch.nodes)
    scratch.normals[static_cast<std::size_t>(i)] = distance<D>(contact.interface, model.mesh.points[i]).normal;
  find_reaches(model, contact);
  if (contact.adhesion > 0)
    find_areas(model, contact);
  for (Index i : scratch.nodes)
  {
    const auto k = static_cast<std::size_t>(i);
    const Reaches& reach = scratch.reaches[k];
    ContactNode<D> at{i, scratch.normals[k], std::max(0.0, -(reach.first + reach.second)), {}, false, {}};
    const Vector<D> relative =
        difference<D>(trial_velocity(first, i, gravity, dt), trial_velocity(second, i, gravity, dt));
    double bond = 0;
    if (contact.adhesion > 0)
    {
      bond = bond_of<D>(contact, at.gap, std::max(0.0, 0.5 * dot<D>(scratch.areas[k], at.normal)), dt);
      if constexpr (G::has_hoop)
        bond *= model.mesh.points[i][0];
    }
    const Vector<D> impulse = impulse_of(Pair<G>{first, second, i}, contact, at, relative, bond, dt);
    if (impulse == Vector<D>{})
      continue;
    at.force = sum<D>({}, 1 / dt, impulse);
    contact.touching.push_back(at);
  }
}
} // namespace

template <class G>
void add_field_contact_forces(Model<G>& model, const Vector<G::dim>& gravity, double dt)
{
  constexpr int D = G::dim;
  note_shift_work(model);
  for (FieldContact<D>& contact : model.field_contacts)
  {
    find_forces(model, gravity, dt, contact);
    contact.force = {};
    for (const ContactNode<D>& at : contact.touching)
    {
      Vector<D>& first = field_at(model, contact.first).nodes[at.node].traction;
      Vector<D>& second = field_at(model, contact.second).nodes[at.node].traction;
      first = sum<D>(first, -1, at.force);
      second = sum<D>(second, 1, at.force);
      if (model.exchange.owned[at.node])
        contact.force = sum<D>(contact.force, 1, at.force);
    }
    contact.impulse = sum<D>(contact.impulse, dt, contact.force);
  }
}

template <class G>
void separate_fields(Model<G>& model, double dt)
{
  constexpr int D = G::dim;
  for (FieldContact<D>& contact : model.field_contacts)
    for (ContactNode<D>& at : contact.touching)
    {
      VelocityField<G>&first = field_at(model, contact.first), &second = field_at(model, contact.second);
      at.shift = {};
      if (is_light(first, at.node) || is_light(second, at.node))
        continue;
      Vector<D>&v1 = first.velocity[at.node], &v2 = second.velocity[at.node];
      const double pressing = contact.dt * dot<D>(at.force, at.normal);
      const Vector<D> impulse = separation_of(Pair<G>{first, second, at.node}, at, difference<D>(v1, v2), pressing, dt);
      at.shift = sum<D>({}, dt, impulse);
      v1 = sum<D>(v1, -1, mobility(first, at.node, impulse));
      v2 = sum<D>(v2, 1, mobility(second, at.node, impulse));
    }
}

#define INSTANTIATE(G)                                                                                                 \
  template void add_field_contact_forces(Model<G>&, const Vector<G::dim>&, double);                                    \
  template void separate_fields(Model<G>&, double);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
