#include "contact/clearance.h"
#include "contact/touch.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace mpm::contact
{
namespace
{
/// Data of a step that all particles need.
template <int D>
struct Press
{
  double dt;
  double stiffness; ///< per mass [1/s2]
  bool rotated;     ///< whether the body is
  bool turns;       ///< whether it rotates in the step
  Matrix<3> turn;   ///< its rotation in the step, less the identity
  double per_mass;  ///< translation of a free body under a force: 1/M [1/kg]
  double per_inertia;
  std::vector<Column>* slips;
  const std::vector<Column>* bonds; ///< of particles that are tied to the surface; null where they only touch it
};

template <int D>
Press<D> press_of(const Contact<D>& contact, double dt, Particles<D>& particles)
{
  const RigidBody<D>& body = contact.body;
  Vector<3> angle;
  for (std::size_t k = 0; k < 3; ++k)
    angle[k] = dt * body.spin[k];
  Matrix<3> turn = rotation_by(angle);
  for (std::size_t k = 0; k < 3; ++k)
    turn[k][k] -= 1;
  const double least = D == 2 ? body.inertia[2] : std::ranges::min(body.inertia);
  const bool free = std::ranges::count(body.drive, Drive::free) > 0;
  return {dt,
          contact.penalty / (contact.stiff_step * contact.stiff_step),
          body.rotation != rotation_by({}),
          body.spin != Vector<3>{},
          turn,
          free ? 1 / body.mass : 0,
          body.rotates ? 1 / least : 0,
          columns_of(particles, contact.slip),
          columns_of(particles, contact.bond)};
}

/// A particle at the surface.
template <int D>
struct Touch
{
  Vector<D> normal; ///< out of the body
  Vector<D> arm;    ///< from the body's centre to the nearest point of its surface
  Vector<D> motion; ///< of the particle in the step, relative to that point
  double before;    ///< distance from there at the step's start [m]
  double after;     ///< at its end, along the normal [m]
};

template <int D>
Touch<D> touch_of(const Contact<D>& contact, const Press<D>& press, const Distance<D>& nearest, const Vector<D>& x,
                  const Vector<D>& velocity)
{
  const RigidBody<D>& body = contact.body;
  const double apart = nearest.value;
  Touch<D> touch;
  touch.normal = press.rotated ? rotated<D>(body.rotation, nearest.normal) : nearest.normal;
  for (int i = 0; i < D; ++i)
    touch.arm[i] = x[i] - apart * touch.normal[i] - body.displacement[i] - body.centre[i];
  const Vector<D> turned = press.turns ? rotated<D>(press.turn, touch.arm) : Vector<D>{};
  for (int i = 0; i < D; ++i)
    touch.motion[i] = press.dt * (velocity[i] - body.velocity[i]) - turned[i];
  touch.before = apart;
  touch.after = apart + dot<D>(touch.motion, touch.normal);
  return touch;
}

/// Whether a particle touches the surface or is within its own radius of doing so.
template <class G>
bool is_near(const Particles<G::dim>& particles, Index p, double distance)
{
  return fits<G::dim>(distance, particle_cube<G>(particles, p));
}

/// Lets the slip of a particle go that does not touch the surface.
template <int D>
void leave_slip(const Press<D>& press, Index p)
{
  for (std::size_t i = 0; press.slips && i < D; ++i)
    (*press.slips)[i][p] = 0;
}

/// Force on a particle.
template <int D>
struct ParticleForce
{
  Vector<D> force;
  Vector<D> normal;      ///< the part of it along the normal of the surface
  double water_fraction; ///< of that part
  Vector<D> facing;      ///< the area of the surface that it covers, times the normal [m2]
};

/// Force on a particle that is tied to the surface, by all of its motion relative to the body.
template <class G, int D = G::dim>
std::optional<ParticleForce<D>> bond_force(const Press<D>& press, const Distance<D>& nearest, const Vector<D>& velocity,
                                           const Particles<D>& particles, Index p, Contact<D>& contact)
{
  const Vector<D> x = at<D>(particles.position, p);
  const Touch<D> touch = touch_of<D>(contact, press, nearest, x, velocity);
  const Vector<D> stretch = difference<D>(x, as_it_is<D>(contact.body, anchor_of<D>(*press.bonds, p)));
  Vector<D> arm, force;
  for (int i = 0; i < D; ++i)
    arm[i] = x[i] - contact.body.displacement[i] - contact.body.centre[i];
  const Vector<D> turned = rotated<D>(press.turn, arm);
  const double mass = particles.mass[p], stiffness = press.stiffness * mass;
  for (int i = 0; i < D; ++i)
    force[i] = -stiffness * (stretch[i] + press.dt * (velocity[i] - contact.body.velocity[i]) - turned[i]);
  const double area = particle_area<G>(particles, p, particle_radius<G>(particles, p), touch.normal[0]);
  Reaction<D>& reaction = contact.reaction;
  reaction.energy += 0.5 * stiffness * dot<D>(stretch, stretch);
  reaction.load += mass * (press.per_mass + press.per_inertia * dot<D>(arm, arm));
  reaction.area += area;
  reaction.mass += mass;
  reaction.sticking += area;
  reaction.normal += dot<D>(force, touch.normal);
  react<D>(force, arm, reaction);
  ParticleForce<D> found{force, touch.normal, 0, touch.normal};
  for (double& component : found.normal)
    component *= dot<D>(force, touch.normal);
  for (double& component : found.facing)
    component *= area;
  return found;
}

/// Shear strength by the velocity of a particle along the surface, C rho v^2 (Voellmy 1955) [Pa].
template <int D>
double turbulent_stress(const Resistance& strength, const Press<D>& press, const Touch<D>& touch,
                        const Particles<D>& particles, Index p)
{
  if (strength.drag == 0)
    return 0;
  const Vector<D> sliding = tangential<D>(touch.motion, touch.normal);
  return strength.drag * particles.mass[p] / particles.volume[p] * dot<D>(sliding, sliding) / (press.dt * press.dt);
}

/// Force on a particle, whose velocity is that of the nodes at its place; takes its slip along. None without contact,
/// but beside water that moves by itself none only where the surface is farther than the particle's radius.
template <class G, int D = G::dim>
std::optional<ParticleForce<D>> particle_force(const Press<D>& press, const Distance<D>& nearest,
                                               const Vector<D>& velocity, const Particles<D>& particles, Index p,
                                               const WaterBeside<D>* water, Contact<D>& contact)
{
  const Touch<D> touch = touch_of<D>(contact, press, nearest, at<D>(particles.position, p), velocity);
  if (!is_near<G>(particles, p, touch.after))
  {
    leave_slip<D>(press, p);
    return std::nullopt;
  }
  const double radius = particle_radius<G>(particles, p), mass = particles.mass[p];
  const double overlap = radius - touch.before, depth = radius - touch.after; // at the step's start and end
  Reaction<D>& reaction = contact.reaction;
  reaction.load += mass * (press.per_mass + press.per_inertia * dot<D>(touch.arm, touch.arm));
  const double stiffness = press.stiffness * mass;
  Vector<D> slip{};
  for (std::size_t i = 0; press.slips && i < D; ++i)
    slip[i] = (*press.slips)[i][p];
  if (overlap > 0)
    reaction.energy += 0.5 * stiffness * (overlap * overlap);
  reaction.energy += 0.5 * stiffness * dot<D>(slip, slip);
  const double area = particle_area<G>(particles, p, radius, touch.normal[0]);
  ParticleForce<D> found{{}, {}, 0, touch.normal};
  for (double& component : found.facing)
    component *= area;
  const Resistance& strength = resistance_at(contact, nearest.part);
  const double cohesive = strength.adhesion + turbulent_stress(strength, press, touch, particles, p); // [Pa]
  const bool clings = strength.adhesion > 0 || strength.drag > 0;
  const double covered = area * (clings ? covered_part(touch.after, radius) : depth > 0 ? 1 : 0);
  if (!(depth > 0) && !clings)
  {
    leave_slip<D>(press, p);
    return water ? std::optional(found) : std::nullopt;
  }
  const double pressed = std::max(depth, 0.0);
  reaction.area += covered;
  reaction.mass += mass;
  reaction.pressing += depth > 0 ? mass : 0;
  reaction.normal += stiffness * pressed;
  const WaterShare share{water && depth > 0 ? water->fraction(particles.cell[p], touch.normal) : 0};
  if (press.slips)
  {
    const double longest = strength.friction * carried_by_grains(share) * pressed + cohesive * covered / stiffness;
    reaction.sticking += update_slip<D>(touch.normal, touch.motion, longest, slip) ? covered : 0;
    for (std::size_t i = 0; i < D; ++i)
      (*press.slips)[i][p] = slip[i];
  }
  found.water_fraction = share.fraction;
  for (int i = 0; i < D; ++i)
  {
    found.normal[i] = stiffness * pressed * touch.normal[i];
    found.force[i] = stiffness * (pressed * touch.normal[i] - slip[i]);
  }
  react<D>(found.force, touch.arm, reaction);
  return found;
}

/// Lower bound of the distance of a point of a cell from the surface, where it was when the bounds were found.
template <int D>
double height_over(const CellBound<D>& bound, const Vector<D>& x)
{
  return std::min(dot<D>(bound.normal, x) - bound.height, bound.ceiling);
}

/// Such a bound for all points of a cell.
template <int D>
double lowest_point(const Mesh<D>& mesh, Index cell, const CellBound<D>& bound)
{
  double lowest = std::numeric_limits<double>::infinity();
  for (Index node : mesh.cells[static_cast<std::size_t>(cell)])
    lowest = std::min(lowest, height_over<D>(bound, mesh.points[static_cast<std::size_t>(node)]));
  return lowest;
}

/// Data of the surface in this step for the particles of a cell.
template <int D>
struct Sight
{
  CellBound<D> bound;
  std::span<const Index> parts;
  double travelled; ///< by the surface since the bounds were found, up to the end of the step [m]
  double motion;    ///< towards the surface since then, at most [m]
  double width;     ///< of the largest particle, and its motion [m]
};

template <int D>
Sight<D> sight_of(const Contact<D>& contact, Index cell, double travelled, const Extremes& extremes)
{
  const CellBound<D>& bound = contact.bounds[static_cast<std::size_t>(cell)];
  const double motion = travelled + extremes.motion;
  return {bound, std::span<const Index>(contact.parts).subspan(bound.first, bound.last - bound.first), travelled,
          motion, motion + (D == 3 ? std::cbrt(extremes.cube) : std::sqrt(extremes.cube))};
}

/// Distance of a particle from the surface where it may matter, at the step's start; nothing where it is farther than
/// its own size, also at the end.
/// @param xi     from the centre of its cell [m]
/// @param start  see `distance_within`
template <class G, int D = G::dim>
std::optional<Distance<D>> near_distance(const Contact<D>& contact, const Press<D>& press, const Sight<D>& sight,
                                         const Vector<D>& x, const Vector<D>& xi, double cube, Index& start)
{
  const CellBound<D>& bound = sight.bound;
  const double height = height_over<D>(bound, x), from_centre = norm<D>(xi);
  const RigidBody<D>& body = contact.body;
  const Vector<D> as_it_was = press.rotated ? as_at_start<D>(body, x) : difference<D>(x, body.displacement);
  if (bound.blind)
    return distance<D>(contact.surface, as_it_was);
  if (!fits<D>(std::max(height, bound.distance - from_centre) - sight.motion, cube))
    return std::nullopt;
  // A particle is outside if it is above all of the surface that is close, or if there is none between it and the
  // centre of its cell, which is outside.
  const double visible = bound.sight - sight.travelled;
  const bool above = height > sight.motion;
  const double limit = above ? sight.width : std::max(from_centre + sight.travelled, sight.width);
  if ((above || bound.distance > sight.travelled) && limit <= visible)
    return distance_within<D>(contact.surface, as_it_was, sight.parts, limit, start);
  if (const auto found = distance_within<D>(contact.surface, as_it_was, sight.parts, std::max(visible, 0.0), start))
    return found;
  return distance<D>(contact.surface, as_it_was);
}

/// Moments of the forces on the particles of a run.
template <int D>
struct RunForces
{
  TractionMoments<D> all{};
  TractionMoments<D> on_water{}; ///< the part that water which moves by itself carries
  TractionMoments<D> facing{};   ///< of the areas that the particles cover, with such water
};

/// Adds a fraction of a force.
template <int D>
void add_force(double fraction, const Vector<D>& force, const Vector<D>& xi, TractionMoments<D>& moments)
{
  for (int i = 0; i < D; ++i)
  {
    moments.force[i] += fraction * force[i];
    for (int j = 0; j < D; ++j)
      moments.force_xi[i][j] += fraction * force[i] * xi[j];
  }
}

template <int D>
void add_to_nodes(const Mesh<D>& mesh, Index cell, const TractionMoments<D>& moments, std::span<Vector<D>> forces)
{
  for (int k = 0; k <= D; ++k)
    for (int i = 0; i < D; ++i)
      forces[static_cast<std::size_t>(mesh.cells[cell][k])][i] +=
          at_vertex<D>(moments.force[i], moments.force_xi[i], mesh.shapes[cell].gradient[k]);
}

/// Forces on the particles of a run, by their moments.
/// @returns whether any was in contact
template <class G, int D = G::dim>
bool press_run(const Mesh<D>& mesh, const Run& run, std::span<const Vector<D>> velocity, const Press<D>& press,
               const Sight<D>& sight, const WaterBeside<D>* water, Particles<D>& particles, Contact<D>& contact,
               RunForces<D>& forces)
{
  const auto nodal = [velocity](Index i) -> const Vector<D>& { return velocity[static_cast<std::size_t>(i)]; };
  std::optional<AffineField<D>> field; // found where any particle is near
  bool touched = false;
  Index start = sight.bound.start;
  for (Index p = run.first; p < run.last; ++p)
  {
    const Vector<D> x = at<D>(particles.position, p), xi = difference<D>(x, mesh.shapes[run.cell].centre);
    if (press.bonds && !is_tied(*press.bonds, p))
      continue;
    const auto nearest = press.bonds
                             ? distance<D>(contact.surface, as_at_start<D>(contact.body, x))
                             : near_distance<G, D>(contact, press, sight, x, xi, particle_cube<G>(particles, p), start);
    if (!nearest)
    {
      leave_slip<D>(press, p);
      continue;
    }
    if (!field)
      field = affine_field<D>(mesh, run.cell, nodal);
    Vector<D> v;
    for (int i = 0; i < D; ++i)
      v[i] = field->value[i] + dot<D>(field->gradient[i], xi);
    const auto found = press.bonds ? bond_force<G, D>(press, *nearest, v, particles, p, contact)
                                   : particle_force<G, D>(press, *nearest, v, particles, p, water, contact);
    if (!found)
      continue;
    touched = true;
    add_force<D>(1, found->force, xi, forces.all);
    if (!water)
      continue;
    add_force<D>(found->water_fraction, found->normal, xi, forces.on_water);
    add_force<D>(1, found->facing, xi, forces.facing);
  }
  return touched;
}
} // namespace

template <class G, int D>
bool add_contact_forces(const Mesh<D>& mesh, const std::vector<Run>& runs, const Movers& movers,
                        std::span<const Vector<D>> velocity, double dt, Particles<D>& particles, Contact<D>& contact,
                        std::span<Vector<D>> forces, const WaterBeside<D>* water)
{
  const Press<D> press = press_of(contact, dt, particles);
  const double travelled = contact.travel + step_travel(contact, contact.body, dt);
  bool touched = false;
  for (const Run& run : runs)
  {
    const CellBound<D>& bound = contact.bounds[static_cast<std::size_t>(run.cell)];
    if (!may_be_near(bound, travelled) || movers.field_of_law[static_cast<std::size_t>(run.material)] != movers.field)
      continue;
    const double gap = std::max(bound.distance - bound.reach, lowest_point<D>(mesh, run.cell, bound)) - travelled;
    const Extremes extremes = extremes_of<G, D>(mesh, run, velocity, dt, particles);
    if (!may_be_near<D>(extremes, gap))
    {
      for (Index p = run.first; p < run.last; ++p)
        leave_slip<D>(press, p);
      continue;
    }
    RunForces<D> found;
    const auto cell = static_cast<Index>(run.cell);
    const Sight<D> sight = sight_of<D>(contact, cell, travelled, extremes);
    if (!press_run<G, D>(mesh, run, velocity, press, sight, water, particles, contact, found))
      continue;
    touched = true;
    add_to_nodes<D>(mesh, cell, found.all, forces);
    if (!water)
      continue;
    add_to_nodes<D>(mesh, cell, found.on_water, water->forces);
    add_to_nodes<D>(mesh, cell, found.facing, water->facing);
  }
  return touched;
}

#define INSTANTIATE(G)                                                                                                 \
  template bool add_contact_forces<G, G::dim>(                                                                         \
      const Mesh<G::dim>&, const std::vector<Run>&, const Movers&, std::span<const Vector<G::dim>>, double,            \
      Particles<G::dim>&, Contact<G::dim>&, std::span<Vector<G::dim>>, const WaterBeside<G::dim>*);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::contact
