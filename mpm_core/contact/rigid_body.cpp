#include "contact/rigid_body.h"

#include <algorithm>
#include <cmath>

namespace mpm::contact
{
Matrix<3> rotation_by(const Vector<3>& angle)
{
  // Rodrigues: I + sin(a) K + (1 - cos(a)) K K with the matrix K of the cross product with the axis
  const double a = norm<3>(angle);
  Matrix<3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  if (a == 0)
    return rotation;
  const Vector<3> k{angle[0] / a, angle[1] / a, angle[2] / a};
  const Matrix<3> cross{{{0, -k[2], k[1]}, {k[2], 0, -k[0]}, {-k[1], k[0], 0}}};
  const Matrix<3> twice = product<3>(cross, cross);
  const double half = std::sin(0.5 * a), versine = 2 * half * half; // 1 - cos(a) without cancellation
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      rotation[i][j] += std::sin(a) * cross[i][j] + versine * twice[i][j];
  return rotation;
}

template <int D>
bool moves_freely(const RigidBody<D>& body)
{
  return body.rotates || std::ranges::count(body.drive, Drive::free) > 0;
}

template <int D>
bool needs_reaction(const RigidBody<D>& body)
{
  return moves_freely(body) || std::ranges::count(body.drive, Drive::servo) > 0;
}

namespace
{
/// Spin in space from the angular momentum about the body's axes.
template <int D>
Vector<3> spin_of(const RigidBody<D>& body)
{
  Vector<3> spin{};
  for (std::size_t k = D == 2 ? 2 : 0; k < 3; ++k)
    spin[k] = body.angular_momentum[k] / body.inertia[k];
  return rotated<3>(body.rotation, spin);
}

/// Rotates the body freely: about one principal axis after the other, each by its own part of the kinetic energy.
template <int D>
void rotate_freely(double dt, RigidBody<D>& body)
{
  constexpr std::array<std::size_t, 5> axes{0, 1, 2, 1, 0};
  for (std::size_t k = 0; k < 5; ++k)
  {
    const std::size_t axis = axes[k];
    if (body.angular_momentum[axis] == 0)
      continue;
    Vector<3> angle{};
    angle[axis] = (k == 2 ? 1.0 : 0.5) * dt * body.angular_momentum[axis] / body.inertia[axis];
    const Matrix<3> turn = rotation_by(angle);
    body.rotation = product<3>(body.rotation, turn);
    body.angular_momentum = rotated_back<3>(turn, body.angular_momentum);
  }
}
} // namespace

template <int D>
void set_spin(const Vector<3>& spin, RigidBody<D>& body)
{
  body.angular_momentum = rotated_back<3>(body.rotation, spin);
  for (std::size_t k = 0; k < 3; ++k)
    body.angular_momentum[k] *= body.inertia[k];
  body.spin = spin;
}

template <int D>
void prescribe_motion(const TimeStep& step, const Reaction<D>& last, RigidBody<D>& body)
{
  const double end = step.start + step.dt;
  const Vector<D> velocity = mean(body.prescribed_velocity, step.start, end);
  for (std::size_t i = 0; i < D; ++i)
    if (body.drive[i] == Drive::prescribed)
      body.velocity[i] = velocity[i];
    else if (body.drive[i] == Drive::servo)
    {
      // As a dashpot of the strength of sound waves in the soil that it touches, m / dt >= rho c A: it cannot oscillate
      // with the springs of contact, whose stiffness is below m / dt^2.
      const double missing = mean(body.force, step.start, end)[i] + last.force[i];
      const double speed = last.mass > 0 ? step.dt * missing / last.mass : std::copysign(body.fastest, missing);
      body.velocity[i] = missing == 0 ? 0 : std::clamp(speed, -body.fastest, body.fastest);
    }
  if (!body.rotates)
    body.spin = mean(body.prescribed_spin, step.start, end);
}

template <int D>
void accelerate_body(const TimeStep& step, const Vector<D>& gravity, const Reaction<D>& reaction, RigidBody<D>& body)
{
  body.before = {body.velocity, body.spin};
  const double dt = step.dt;
  const Vector<D> applied = mean(body.force, step.start, step.start + dt);
  for (std::size_t i = 0; i < D; ++i)
    if (body.drive[i] == Drive::free)
      body.velocity[i] += dt * ((reaction.force[i] + applied[i]) / body.mass + gravity[i]);
  if (!body.rotates)
    return;
  const Vector<3> moment = rotated_back<3>(body.rotation, reaction.moment);
  for (std::size_t k = D == 2 ? 2 : 0; k < 3; ++k)
    body.angular_momentum[k] += dt * moment[k];
  body.spin = spin_of(body);
}

template <int D>
void move_body(double dt, RigidBody<D>& body)
{
  for (std::size_t i = 0; i < D; ++i)
    body.displacement[i] += dt * body.velocity[i];
  if (body.rotates)
  {
    rotate_freely(dt, body);
    body.spin = spin_of(body);
  }
  Vector<3> angle;
  for (std::size_t k = 0; k < 3; ++k)
  {
    angle[k] = dt * body.spin[k];
    body.angle[k] += angle[k];
  }
  if (!body.rotates)
    body.rotation = product<3>(rotation_by(angle), body.rotation);
}

template <int D>
void stop_driven(RigidBody<D>& body)
{
  for (std::size_t i = 0; i < D; ++i)
    if (body.drive[i] != Drive::prescribed)
      body.velocity[i] = 0;
  if (body.rotates)
    set_spin({}, body);
}

template <int D>
double kinetic_energy(const RigidBody<D>& body)
{
  double energy = 0;
  for (std::size_t i = 0; i < D; ++i)
    if (body.drive[i] == Drive::free)
      energy += 0.5 * body.mass * body.velocity[i] * body.velocity[i];
  for (std::size_t k = D == 2 ? 2 : 0; k < 3 && body.rotates; ++k)
    energy += 0.5 * body.angular_momentum[k] * body.angular_momentum[k] / body.inertia[k];
  return energy;
}

#define INSTANTIATE(D)                                                                                                 \
  template bool moves_freely(const RigidBody<D>&);                                                                     \
  template bool needs_reaction(const RigidBody<D>&);                                                                   \
  template void set_spin(const Vector<3>&, RigidBody<D>&);                                                             \
  template void prescribe_motion(const TimeStep&, const Reaction<D>&, RigidBody<D>&);                                  \
  template void accelerate_body<D>(const TimeStep&, const Vector<D>&, const Reaction<D>&, RigidBody<D>&);              \
  template void move_body(double, RigidBody<D>&);                                                                      \
  template void stop_driven(RigidBody<D>&);                                                                            \
  template double kinetic_energy(const RigidBody<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::contact
