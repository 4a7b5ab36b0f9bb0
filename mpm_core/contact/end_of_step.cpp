#include "contact/end_of_step.h"

#include "contact/clearance.h"

#include <cmath>
#include <optional>

namespace mpm::contact
{
namespace
{
constexpr double relative_stiffness = 50;  ///< of a spring with beta = 1 to its particle
constexpr double smoothing = 1e-5;         ///< of the onset of contact, over the radius of a particle
constexpr double farthest = 30;            ///< gap, over that length, beyond which there is no normal force any more
constexpr double difference_length = 1e-6; ///< for derivatives of the normal, over the radius of a particle

template <int D>
Matrix<D> outer(const Vector<D>& a, const Vector<D>& b)
{
  Matrix<D> m;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      m[i][j] = a[i] * b[j];
  return m;
}

/// a A + b B
template <int D>
Matrix<D> combined(double a, const Matrix<D>& first, double b, const Matrix<D>& second)
{
  Matrix<D> m;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      m[i][j] = a * first[i][j] + b * second[i][j];
  return m;
}

template <int D>
Matrix<D> identity()
{
  Matrix<D> m{};
  for (int i = 0; i < D; ++i)
    m[i][i] = 1;
  return m;
}

/// Distance of a place from the body, and its normal, where the body is.
template <int D>
Distance<D> distance_at(SeenSurface<D>& seen, const RigidBody<D>& body, const Vector<D>& x)
{
  const Surface<D>& surface = seen.contact.surface;
  const Vector<D> as_it_was = as_at_start<D>(body, x);
  std::optional<Distance<D>> found;
  if (seen.within > 0)
    found = distance_within<D>(surface, as_it_was, seen.parts, seen.within, seen.start);
  const auto [apart, normal, part] = found ? *found : distance<D>(surface, as_it_was);
  return {apart, rotated<D>(body.rotation, normal), part};
}

/// Derivative of the normal by the place: symmetric.
template <int D>
Matrix<D> curvature(SeenSurface<D>& seen, const RigidBody<D>& body, const Vector<D>& x, double length)
{
  Matrix<D> by{};
  for (int j = 0; j < D; ++j)
  {
    Vector<D> ahead = x, behind = x;
    ahead[j] += length;
    behind[j] -= length;
    const Vector<D> a = distance_at<D>(seen, body, ahead).normal, b = distance_at<D>(seen, body, behind).normal;
    for (int i = 0; i < D; ++i)
      by[i][j] = (a[i] - b[i]) / (ahead[j] - behind[j]);
  }
  return by;
}

/// The particle's motion relative to the point of the body that it ends at, and its derivative by its displacement but
/// for that of this point, the rotation less the identity.
template <int D>
struct Relative
{
  Vector<D> motion;
  Matrix<D> turn;
};

template <int D>
Relative<D> relative_motion(const RigidBody<D>& start, const RigidBody<D>& end, const Vector<D>& u,
                            const Vector<D>& arm)
{
  Relative<D> relative{};
  for (std::size_t i = 0; i < D; ++i)
    for (std::size_t j = 0; j < D; ++j)
    {
      for (std::size_t k = 0; k < D; ++k)
        relative.turn[i][j] -= start.rotation[i][k] * end.rotation[j][k];
      relative.turn[i][j] += i == j ? 1 : 0;
    }
  const Vector<D> turned = product<D>(relative.turn, arm);
  for (int i = 0; i < D; ++i)
    relative.motion[i] = u[i] - turned[i] - (end.displacement[i] - start.displacement[i]);
  return relative;
}

/// d (P a) / du with a = s_0 + w.
template <int D>
Matrix<D> trial_slip_derivative(const Vector<D>& normal, const Vector<D>& a, const Matrix<D>& turn, double apart,
                                const Matrix<D>& h)
{
  const Matrix<D> projection = combined<D>(1, identity<D>(), -1, outer<D>(normal, normal));
  const Matrix<D> arm = combined<D>(1, projection, -apart, h);
  const Matrix<D> motion = combined<D>(1, identity<D>(), -1, product<D>(turn, arm));
  const Matrix<D> moved = product<D>(projection, motion);
  const Matrix<D> tilted = combined<D>(dot<D>(normal, a), h, 1, outer<D>(normal, product<D>(h, a))); // H is symmetric
  return combined<D>(1, moved, -1, tilted);
}

/// The elastic slip L at which the contact has its shear strength, and its derivatives.
struct LongestSlip
{
  double value;     ///< [m]
  double by_radius; ///< dL/dr [-]
  double by_water;  ///< dL/dp [m/Pa]
};

/// @param overlap  of the particle and the surface, over the length of the onset
template <int D>
LongestSlip longest_slip(const Resistance& strength, const Spring& spring, const WaterShare& water, double overlap,
                         const EndTouch<D>& touch)
{
  const double rises = 1 / (1 + std::exp(-overlap));                       // d depth / d overlap
  const double adheres = strength.adhesion / spring.shear;                 // slip at which adhesion gives way, per area
  const bool partly = 0 < touch.covered && touch.covered < 2 * touch.area; // where that area changes with the gap
  const double per_depth = strength.friction * spring.stiffness / spring.shear, grains = carried_by_grains(water);
  return {per_depth * grains * touch.depth + adheres * touch.covered,
          per_depth * grains * rises + (partly ? adheres * touch.area / spring.radius : 0),
          grains > 0 ? -per_depth * touch.depth * water.per_pressure : 0};
}

/// The derivatives of a slip that is returned to the cone, s = L t with the direction t of the trial.
/// @param a          elastic slip at the step's start and the motion of the step
/// @param slip       in: derivative of the trial by the displacement; out: that of the slip
template <int D>
void slide(const Vector<D>& a, const LongestSlip& longest, const Spring& spring, Matrix<D>& slip, EndTouch<D>& touch)
{
  Vector<D> t = tangential<D>(a, touch.normal);
  const double length = norm<D>(t);
  for (int i = 0; i < D; ++i)
  {
    t[i] /= length;
    touch.by_radius[i] -= spring.shear * longest.by_radius * t[i];
    touch.by_water[i] = -spring.shear * longest.by_water * t[i];
  }
  const Matrix<D> across = combined<D>(1, identity<D>(), -1, outer<D>(t, t));
  slip = combined<D>(longest.value / length, product<D>(across, slip), -longest.by_radius, outer<D>(t, touch.normal));
}

/// Area of the surface that a particle covers [m2].
template <int D>
double area_at(const Spring& spring, const Vector<D>& normal)
{
  return spring.area + spring.by_normal * normal[0];
}
} // namespace

template <int D>
RigidBody<D> body_at_end(const Contact<D>& contact, const TimeStep& step, bool at_rest, const Motion<D>& driven)
{
  RigidBody<D> body = contact.body;
  body.velocity = {};
  body.spin = {};
  if (!at_rest)
    prescribe_motion(step, contact.of_ranks, body);
  for (std::size_t i = 0; i < D; ++i)
    if (body.drive[i] != Drive::prescribed)
      body.velocity[i] = driven.velocity[i];
  if (!body.rotates)
  {
    move_body(step.dt, body);
    return body;
  }
  body.spin = driven.spin;
  body.rotates = false; // as if the spin was prescribed: constant in the step
  move_body(step.dt, body);
  body.rotates = true;
  set_spin(driven.spin, body);
  return body;
}

template <int D>
SeenSurface<D> seen_from(const Contact<D>& contact, Index cell, double motion)
{
  constexpr double safe = 0.99; // places for differences are slightly beyond
  const CellBound<D>& bound = contact.bounds[static_cast<std::size_t>(cell)];
  return {contact, std::span<const Index>(contact.parts).subspan(bound.first, bound.last - bound.first),
          bound.blind ? 0 : safe * (bound.sight - motion), bound.start};
}

template <class G>
Spring spring_of(const Particles<G::dim>& particles, Index p, const ContactModuli& moduli, double penalty)
{
  const double radius = particle_radius<G>(particles, p), area = particle_area<G>(particles, p, radius, 0);
  const double per_modulus = relative_stiffness * penalty * area / (2 * radius);
  return {radius,
          smoothing * radius,
          area,
          G::has_hoop ? -2 * radius * radius : 0,
          per_modulus * moduli.compression,
          per_modulus * moduli.shear};
}

template <class G>
EndRadius radius_at_end(const Particles<G::dim>& particles, Index p, double volumetric, const Vector<G::dim>& u)
{
  const double stretch = G::has_hoop ? 1 + u[0] / particles.position[0][p] : 1; // of the ring, which is volume, too
  const double growth = (1 + volumetric) / stretch;
  const double radius = particle_radius<G>(particles, p) * (G::dim == 3 ? std::cbrt(growth) : std::sqrt(growth));
  return {radius, radius / (G::dim * (1 + volumetric)),
          G::has_hoop ? -radius / (G::dim * stretch * particles.position[0][p]) : 0};
}

template <int D>
Vector<D> edge_at_start(SeenSurface<D>& seen, double radius, const Vector<D>& x)
{
  const Vector<D> normal = distance_at<D>(seen, seen.contact.body, x).normal;
  Vector<D> edge;
  for (int i = 0; i < D; ++i)
    edge[i] = x[i] - radius * normal[i];
  return edge;
}

template <int D>
bool touches_at_end(SeenSurface<D>& seen, const RigidBody<D>& end, const Spring& spring, const WaterShare& water,
                    double radius, const Vector<D>& x, const Vector<D>& u, const Vector<D>& old, bool tangent,
                    EndTouch<D>& touch)
{
  const Contact<D>& contact = seen.contact;
  Vector<D> place;
  for (int i = 0; i < D; ++i)
    place[i] = x[i] + u[i];
  const auto [apart, normal, part] = distance_at<D>(seen, end, place);
  touch.normal = normal;
  touch.area = area_at<D>(spring, normal);
  const double overlap = (radius - apart) / spring.onset;
  const Resistance& strength = resistance_at(contact, part);
  touch.presses = overlap >= -farthest;
  const double covers = covered_part(spring.radius - overlap * spring.onset, spring.radius);
  if (!touch.presses && !(strength.adhesion > 0 && covers > 0))
    return false;
  touch.covered = touch.area * (strength.adhesion > 0 ? covers : 1);
  touch.depth = spring.onset * (std::max(overlap, 0.0) + std::log1p(std::exp(-std::abs(overlap))));
  for (int i = 0; i < D; ++i)
    touch.arm[i] = place[i] - apart * normal[i] - end.displacement[i] - end.centre[i];
  const Relative<D> relative = relative_motion<D>(contact.body, end, u, touch.arm);
  const bool rough = !contact.slip.empty();
  const LongestSlip longest = longest_slip<D>(strength, spring, water, overlap, touch);
  touch.slip = rough ? old : Vector<D>{};
  if (rough)
    touch.sticks = update_slip<D>(normal, relative.motion, longest.value, touch.slip);
  for (int i = 0; i < D; ++i)
    touch.force[i] = spring.stiffness * touch.depth * normal[i] - spring.shear * touch.slip[i];
  if (!tangent)
    return true;

  const Matrix<D> h = curvature<D>(seen, end, place, difference_length * radius);
  const double rises = 1 / (1 + std::exp(-overlap)); // d depth / d overlap
  touch.stiffness = combined<D>(spring.stiffness * rises, outer<D>(normal, normal), -spring.stiffness * touch.depth, h);
  for (int i = 0; i < D; ++i)
    touch.by_radius[i] = spring.stiffness * rises * normal[i];
  if (!rough)
    return true;
  Vector<D> a;
  for (int i = 0; i < D; ++i)
    a[i] = old[i] + relative.motion[i];
  Matrix<D> slip = trial_slip_derivative<D>(normal, a, relative.turn, apart, h);
  if (!touch.sticks)
    slide<D>(a, longest, spring, slip, touch);
  touch.stiffness = combined<D>(1, touch.stiffness, spring.shear, slip);
  return true;
}

template <int D>
EndTouch<D> tied_at_end(SeenSurface<D>& seen, const RigidBody<D>& end, const Spring& spring, const Vector<D>& x,
                        const Vector<D>& u, const Vector<D>& anchor)
{
  const Vector<D> there = as_it_is<D>(end, anchor);
  EndTouch<D> touch;
  Vector<D> place;
  for (int i = 0; i < D; ++i)
    place[i] = x[i] + u[i];
  touch.normal = distance_at<D>(seen, end, place).normal;
  touch.area = touch.covered = area_at<D>(spring, touch.normal);
  for (int i = 0; i < D; ++i)
  {
    touch.arm[i] = place[i] - end.displacement[i] - end.centre[i];
    touch.slip[i] = place[i] - there[i];
    touch.force[i] = -spring.stiffness * touch.slip[i];
  }
  touch.stiffness = combined<D>(spring.stiffness, identity<D>(), 0, identity<D>());
  return touch;
}

#define INSTANTIATE(D)                                                                                                 \
  template SeenSurface<D> seen_from<D>(const Contact<D>&, Index, double);                                              \
  template EndTouch<D> tied_at_end<D>(SeenSurface<D>&, const RigidBody<D>&, const Spring&, const Vector<D>&,           \
                                      const Vector<D>&, const Vector<D>&);                                             \
  template RigidBody<D> body_at_end<D>(const Contact<D>&, const TimeStep&, bool, const Motion<D>&);                    \
  template Vector<D> edge_at_start<D>(SeenSurface<D>&, double, const Vector<D>&);                                      \
  template bool touches_at_end<D>(SeenSurface<D>&, const RigidBody<D>&, const Spring&, const WaterShare&, double,      \
                                  const Vector<D>&, const Vector<D>&, const Vector<D>&, bool, EndTouch<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
#undef INSTANTIATE
#define INSTANTIATE(G)                                                                                                 \
  template Spring spring_of<G>(const Particles<G::dim>&, Index, const ContactModuli&, double);                         \
  template EndRadius radius_at_end<G>(const Particles<G::dim>&, Index, double, const Vector<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::contact
