#pragma once
/// @file
/// The motion of a rigid body: prescribed, free under forces, or controlled by the force on it.
///
/// A step is that of the nodes: velocities take the forces at its start, then the body moves with the new ones. A body
/// that rotates freely does so by five rotations about its principal axes (Dullweber, Leimkuhler & McLachlan, J. Chem.
/// Phys. 107, 1997): its angular momentum is kept to round-off, and its energy does not drift.

#include "base/tensor.h"
#include "contact/history.h"

namespace mpm::contact
{
/// What moves a body along an axis.
enum class Drive
{
  prescribed, ///< by its velocity
  free,       ///< by gravity, the applied force and contact
  servo       ///< towards balance of the applied force and contact
};

/// What the soil does to a body in a step, and what the body needs to know of it.
template <int D>
struct Reaction
{
  Vector<D> force{};   ///< on the body [N]
  Vector<3> moment{};  ///< about its centre [N m]
  double normal = 0;   ///< sum of the normal forces [N]
  double area = 0;     ///< of the soil in contact [m2]
  double sticking = 0; ///< part of that area that does not slide [m2]
  double mass = 0;     ///< of the particles that act on it [kg]
  double pressing = 0; ///< part of that mass that touches it; not of a restored model before its next step [kg]
  double load = 0;     ///< sum of m (1/M + r^2/I) over the particles in contact or about to be; bodies that move freely
  double energy = 0;   ///< of the springs at the step's start [J]
};

/// Velocity of a body's centre, and its angular velocity.
template <int D>
struct Motion
{
  Vector<D> velocity; ///< [m/s]
  Vector<3> spin;     ///< [rad/s]
};

template <int D>
struct RigidBody
{
  // Given
  Vector<D> centre;               ///< centre of mass at the start; the body rotates about it [m]
  History<D> prescribed_velocity; ///< along axes that are prescribed [m/s]
  History<3> prescribed_spin;     ///< unless it rotates freely; about z alone in two dimensions [rad/s]
  std::array<Drive, D> drive{};
  bool rotates = false; ///< freely
  double mass = 0;      ///< [kg]
  Vector<3> inertia{};  ///< principal moments about its axes, which are x, y, z at the start [kg m2]
  History<D> force;     ///< applied at the centre [N]
  double fastest = 0;   ///< speed of a servo [m/s]

  // Where it is, and how it moves
  Vector<D> displacement{};
  Matrix<3> rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vector<3> angle{}; ///< integral of the spin [rad]
  Vector<D> velocity{};
  Vector<3> spin{};
  Vector<3> angular_momentum{};  ///< about its own axes; used where it rotates freely [N m s]
  Motion<D> before{};            ///< the forces of this step
  Vector<D> collision_impulse{}; ///< of other bodies since it was made [N s]
};

/// A step of a run.
struct TimeStep
{
  double start; ///< [s]
  double dt;    ///< [s]
};

template <int D>
bool moves_freely(const RigidBody<D>& body);

/// Whether the motion depends on the forces of the soil.
template <int D>
bool needs_reaction(const RigidBody<D>& body);

/// Sets the velocities along axes that are prescribed or controlled, and a prescribed spin.
/// @param last  over all ranks, of the step before; used by servos
template <int D>
void prescribe_motion(const TimeStep& step, const Reaction<D>& last, RigidBody<D>& body);

/// New velocities along the free axes, and the new angular momentum.
/// @param reaction  over all ranks; used where `needs_reaction`
template <int D>
void accelerate_body(const TimeStep& step, const Vector<D>& gravity, const Reaction<D>& reaction, RigidBody<D>& body);

/// Ends a step: the new place.
template <int D>
void move_body(double dt, RigidBody<D>& body);

/// Gives a body that rotates freely this spin [rad/s].
template <int D>
void set_spin(const Vector<3>& spin, RigidBody<D>& body);

/// Lets the axes that are not prescribed rest: velocities of a step without inertia are only ways over its length.
template <int D>
void stop_driven(RigidBody<D>& body);

/// Kinetic energy along the free axes and of free rotation [J].
template <int D>
double kinetic_energy(const RigidBody<D>& body);

/// Rotation about an axis by an angle, given as their product [rad].
Matrix<3> rotation_by(const Vector<3>& angle);

template <int D>
inline Vector<3> in_space(const Vector<D>& v)
{
  if constexpr (D == 2)
    return {v[0], v[1], 0};
  else
    return v;
}

/// A vector in space, rotated as the body is.
template <int D>
inline Vector<D> rotated(const Matrix<3>& rotation, const Vector<D>& v)
{
  Vector<D> w{};
  for (std::size_t i = 0; i < D; ++i)
    for (std::size_t j = 0; j < D; ++j)
      w[i] += rotation[i][j] * v[j];
  return w;
}

/// The inverse of `rotated`.
template <int D>
inline Vector<D> rotated_back(const Matrix<3>& rotation, const Vector<D>& v)
{
  Vector<D> w{};
  for (std::size_t i = 0; i < D; ++i)
    for (std::size_t j = 0; j < D; ++j)
      w[i] += rotation[j][i] * v[j];
  return w;
}
} // namespace mpm::contact
