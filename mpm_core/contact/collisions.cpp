#include "contact/collisions.h"

#include "contact/clearance.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace mpm::contact
{
namespace
{
constexpr int most_sweeps = 200;
constexpr double tolerance = 1e-12; ///< of the fastest approach that is left, over that at first

/// A ball and another body that touch.
template <int D>
struct Meeting
{
  RigidBody<D>*ball, *other;
  Vector<D> normal;              ///< out of the other body
  Vector<D> arm_ball, arm_other; ///< from their centres to the point where they touch
  double friction, restitution;
  double pushed; ///< velocity along the normal that the forces of the step gave [m/s]
};

/// Velocity of a point of a body that moves and rotates so.
template <int D>
Vector<D> at_point(const Vector<D>& velocity, const Vector<3>& spin, const Vector<D>& arm)
{
  const Vector<3> turning = cross(spin, in_space<D>(arm));
  Vector<D> v;
  for (std::size_t i = 0; i < D; ++i)
    v[i] = velocity[i] + turning[i];
  return v;
}

/// Change of the motion of a body by an impulse at a point.
template <int D>
Motion<D> response(const RigidBody<D>& body, const Vector<D>& arm, const Vector<D>& impulse)
{
  Motion<D> change{};
  for (std::size_t i = 0; i < D; ++i)
    if (body.drive[i] == Drive::free)
      change.velocity[i] = impulse[i] / body.mass;
  if (body.rotates)
  {
    Vector<3> angular = rotated_back<3>(body.rotation, cross(in_space<D>(arm), in_space<D>(impulse)));
    for (std::size_t k = 0; k < 3; ++k)
      angular[k] = k < (D == 2 ? 2 : 0) ? 0 : angular[k] / body.inertia[k];
    change.spin = rotated<3>(body.rotation, angular);
  }
  return change;
}

/// Velocity of the ball relative to the other body where they touch.
template <int D>
Vector<D> relative_velocity(const Meeting<D>& meeting)
{
  return difference<D>(at_point<D>(meeting.ball->velocity, meeting.ball->spin, meeting.arm_ball),
                       at_point<D>(meeting.other->velocity, meeting.other->spin, meeting.arm_other));
}

/// Change of the relative velocity along a direction by an impulse along it: 1/m of a mass point [1/kg].
template <int D>
double inverse_mass(const Meeting<D>& meeting, const Vector<D>& direction)
{
  const auto of = [&direction](const RigidBody<D>& body, const Vector<D>& arm)
  {
    const Motion<D> change = response<D>(body, arm, direction);
    return dot<D>(at_point<D>(change.velocity, change.spin, arm), direction);
  };
  return of(*meeting.ball, meeting.arm_ball) + of(*meeting.other, meeting.arm_other);
}

template <int D>
void give(const Vector<D>& impulse, const Vector<D>& arm, RigidBody<D>& body)
{
  const Motion<D> change = response<D>(body, arm, impulse);
  for (std::size_t i = 0; i < D; ++i)
  {
    body.velocity[i] += change.velocity[i];
    body.collision_impulse[i] += impulse[i];
  }
  if (!body.rotates)
    return;
  const Vector<3> angular = rotated_back<3>(body.rotation, cross(in_space<D>(arm), in_space<D>(impulse)));
  for (std::size_t k = 0; k < 3; ++k)
  {
    body.angular_momentum[k] += angular[k];
    body.spin[k] += change.spin[k];
  }
}

/// An impulse on the ball, and its opposite on the other body.
template <int D>
void exchange(const Meeting<D>& meeting, double size, Vector<D> direction)
{
  for (double& component : direction)
    component *= size;
  give<D>(direction, meeting.arm_ball, *meeting.ball);
  for (double& component : direction)
    component = -component;
  give<D>(direction, meeting.arm_other, *meeting.other);
}

/// Ends the approach of two bodies, with friction.
/// @param least  approach that counts as none [m/s]
/// @returns the approach [m/s]
template <int D>
double collide(const Meeting<D>& meeting, double least)
{
  const Vector<D>& n = meeting.normal;
  const double approach = -dot<D>(relative_velocity(meeting), n), inverse = inverse_mass<D>(meeting, n);
  if (approach <= least || inverse == 0)
    return 0;
  const double rebound = meeting.restitution * std::clamp(approach + meeting.pushed, 0.0, approach);
  const double normal_impulse = (approach + rebound) / inverse;
  exchange<D>(meeting, normal_impulse, n);
  Vector<D> along = relative_velocity(meeting);
  const double normal_part = dot<D>(along, n);
  for (int i = 0; i < D; ++i)
    along[i] -= normal_part * n[i];
  const double sliding = norm<D>(along);
  if (sliding == 0 || meeting.friction == 0)
    return approach;
  for (double& component : along)
    component /= sliding;
  if (const double inverse_along = inverse_mass<D>(meeting, along); inverse_along > 0)
    exchange<D>(meeting, -std::min(sliding / inverse_along, meeting.friction * normal_impulse), along);
  return approach;
}

/// Centre of a ball where it is now.
template <int D>
Vector<D> centre_now(const Contact<D>& contact)
{
  const RigidBody<D>& body = contact.body;
  Vector<D> x = rotated<D>(body.rotation, difference<D>(std::get<Ball<D>>(contact.surface).centre, body.centre));
  for (int i = 0; i < D; ++i)
    x[i] += body.centre[i] + body.displacement[i];
  return x;
}

/// How a ball and another body touch, if they do: seen from where both are now.
template <int D>
std::optional<Meeting<D>> meeting_of(const Collision& collision, std::vector<Contact<D>>& contacts)
{
  Contact<D>&ball = contacts[collision.ball], &other = contacts[collision.other];
  const Vector<D> centre = centre_now(ball);
  const auto [apart, normal_at_start, part] = distance<D>(other.surface, as_at_start<D>(other.body, centre));
  const double radius = std::get<Ball<D>>(ball.surface).radius;
  if (apart > radius)
    return std::nullopt;
  Meeting<D> meeting{&ball.body,
                     &other.body,
                     rotated<D>(other.body.rotation, normal_at_start),
                     {},
                     {},
                     collision.friction,
                     collision.restitution,
                     0};
  for (int i = 0; i < D; ++i)
  {
    const double point = centre[i] - radius * meeting.normal[i];
    meeting.arm_ball[i] = point - ball.body.centre[i] - ball.body.displacement[i];
    meeting.arm_other[i] = point - other.body.centre[i] - other.body.displacement[i];
  }
  const auto before = [](const RigidBody<D>& body, const Vector<D>& arm)
  { return at_point<D>(body.before.velocity, body.before.spin, arm); };
  const Vector<D> at_start = difference<D>(before(ball.body, meeting.arm_ball), before(other.body, meeting.arm_other));
  meeting.pushed = dot<D>(difference<D>(relative_velocity(meeting), at_start), meeting.normal);
  return meeting;
}
} // namespace

template <int D>
void resolve_collisions(const std::vector<Collision>& collisions, std::vector<Contact<D>>& contacts)
{
  std::vector<Meeting<D>> meetings;
  for (const Collision& collision : collisions)
    if (const auto meeting = meeting_of<D>(collision, contacts))
      meetings.push_back(*meeting);
  double first = 0;
  for (int sweep = 0; sweep < most_sweeps; ++sweep)
  {
    double fastest = 0;
    for (const Meeting<D>& meeting : meetings)
      fastest = std::max(fastest, collide<D>(meeting, tolerance * first));
    if (fastest == 0)
      return;
    first = std::max(first, fastest);
  }
}

template <int D>
double distance_between(const Contact<D>& ball, const Contact<D>& other)
{
  return distance<D>(other.surface, as_at_start<D>(other.body, centre_now(ball))).value -
         std::get<Ball<D>>(ball.surface).radius;
}

#define INSTANTIATE(D)                                                                                                 \
  template void resolve_collisions(const std::vector<Collision>&, std::vector<Contact<D>>&);                           \
  template double distance_between(const Contact<D>&, const Contact<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::contact
