#pragma once
/// @file
/// Contact of particles with a rigid surface: a penalty on the gap, with friction, adhesion and turbulent resistance.
///
/// The gap of a particle is its distance from the surface less its radius r_p = V_p^(1/D) / 2. With the velocity v of
/// the nodes at its place, relative to the surface, the force on it is
///
///     f = kappa <-(g + dt v_n)> n - kappa s,   kappa = beta m_p / dt_c^2,
///     |kappa s| <= mu f_n + (a + C rho v_t^2) A_p (1 - g / r_p),
///
/// with the last factor between 0 and 2 (see `covered_part`), and the elastic slip s, to which dt v_t is added before
/// it is returned to the cone of friction, which the velocity of sliding widens by the turbulent resistance of Voellmy
/// (1955), C = g / xi. Since sum kappa_p N_i N_j <= beta / dt_c^2 M_ij and M_ij is below the lumped masses, contact has
/// no frequency above sqrt(beta) / dt_c, whatever the soil and the mesh; and with the gap and the slip at the end of
/// the step, the nodes never get more work from it than its springs give up, as long as beta dt^2 <= dt_c^2. With a
/// body that moves freely the same holds for dt_c^2 >= (1 + load) dt^2, load = sum m_p (1/M + r_p^2/I)
/// (docs/contact.md).
///
/// Particles that are tied to a surface have the force -kappa (s + dt v) of all their motion s relative to it.

#include "contact/rigid_body.h"
#include "contact/surfaces.h"
#include "mesh/mesh.h"
#include "particles/particles.h"

#include <algorithm>
#include <functional>
#include <limits>

namespace mpm::contact
{
/// What the particles of a cell need not ask the surface, as it was when these bounds were found.
template <int D>
struct CellBound
{
  double distance = 0; ///< of the centre from the surface; a lower bound where the cell is far from it [m]
  double reach = 0;    ///< from the centre to the farthest vertex [m]
  double sight = 0;    ///< from each point of the cell, all of the surface that is closer is among the parts [m]
  double ceiling = 0;  ///< a point x of the cell is at least min(normal . x - height, ceiling) from the surface [m]
  Vector<D> normal{};
  double height = std::numeric_limits<double>::infinity(); ///< unknown [m]
  std::size_t first = 0, last = 0;                         ///< parts of the surface; see `distance_within`
  Index start = -1;                                        ///< the triangle nearest to the centre, if it is known
  bool blind = false;                                      ///< whether `distance` alone is known
};

/// Shear strength of a contact, mu sigma_n + a + C rho v^2.
struct Resistance
{
  double friction = 0; ///< coefficient mu of Coulomb
  double adhesion = 0; ///< shear strength without pressure [Pa]
  double drag = 0;     ///< coefficient C of the square of the velocity of sliding; in explicit steps only
};

/// A rigid surface that touches the particles, how it moves, what it feels, and what it remembers.
template <int D>
struct Contact
{
  Surface<D> surface;                  ///< where it is at the start
  std::vector<Resistance> resistances; ///< a single one, or one for each segment or triangle of the surface
  double penalty;                      ///< beta, in (0, 1]
  RigidBody<D> body;
  std::string slip; ///< name of the particles' field with their elastic slip; empty where it is smooth
  std::string bond; ///< name of their field with 1 where they are tied to it, and where; empty where they only touch it
  double stiff_step = 0; ///< dt_c [s]; 0 before the first step

  Reaction<D> reaction{}; ///< in the last step; this rank's part
  Vector<D> impulse{};    ///< of the soil on the surface since it was made; this rank's part [N s]
  Reaction<D> of_ranks{}; ///< over all ranks, where the motion depends on it; else zero

  // Lower bounds of the distances in each cell
  std::vector<CellBound<D>> bounds{};
  std::vector<Index> parts{};
  double reach = 0;     ///< of the surface from its centre, as far as there is mesh [m]
  double travel = 0;    ///< path of its fastest point since the bounds were found [m]
  double keeps_for = 0; ///< travel after which they are found again [m]
};

/// Shear strength where a particle is nearest to the surface.
/// @param part  the segment or triangle there, see `Distance`
template <int D>
const Resistance& resistance_at(const Contact<D>& contact, Index part)
{
  return contact.resistances[contact.resistances.size() == 1 ? 0 : static_cast<std::size_t>(part)];
}

/// Whether the normal force of the contact causes friction anywhere.
template <int D>
bool has_friction(const Contact<D>& contact)
{
  return std::ranges::any_of(contact.resistances, [](const Resistance& strength) { return strength.friction > 0; });
}

/// A ball and another body that collide where they touch.
struct Collision
{
  std::size_t ball, other; ///< numbers of contacts; the first is that of a ball
  double friction;         ///< coefficient mu of Coulomb
  double restitution;      ///< velocity after an impact over that before it, in [0, 1]
};

/// Half the side of a square or cube as large as a particle [m].
/// @param volume  per radian in axial symmetry [m^D]
/// @param x       distance from the axis there; not used elsewhere [m]
template <class G>
double radius_of(double volume, double x);
template <class G>
double particle_radius(const Particles<G::dim>& particles, Index p);

/// Begins a step: the body's velocity, no force yet, the stiffness, and bounds of the gaps.
template <int D>
void begin_step(const Mesh<D>& mesh, const TimeStep& step, Contact<D>& contact);

/// The forces of a step change the motion of the body.
/// @pre `of_ranks` is there where the motion depends on it
template <int D>
void accelerate(const TimeStep& step, const Vector<D>& gravity, Contact<D>& contact);

/// Ends a step: the body moves.
template <int D>
void end_step(double dt, Contact<D>& contact);

/// Path of the surface's fastest point in a step, moving as the body does [m].
template <int D>
inline double step_travel(const Contact<D>& contact, const RigidBody<D>& body, double dt)
{
  return dt * (norm<D>(body.velocity) + contact.reach * norm<3>(body.spin));
}

/// The particles that move with one velocity field.
struct Movers
{
  std::span<const Index> field_of_law;
  Index field;
};

/// What a surface does to pore water that moves by itself, of which it carries the pressure, too.
template <int D>
struct WaterBeside
{
  /// Fraction of the normal stress on the surface that the water of a cell carries, at most 1; it causes no friction
  std::function<double(Index cell, const Vector<D>& normal)> fraction;
  std::span<Vector<D>> forces; ///< what of the forces acts on the water, at the nodes; added to [N]
  /// Area of the surface that particles cover which it touches, or is no farther from than their radius, times its
  /// normal, at the nodes; added to [m2]
  std::span<Vector<D>> facing;
};

/// Adds the forces on particles to their nodes, and to what the surface feels.
/// @param velocity  of the nodes at the step's start [m/s]
/// @param water     null where the soil has no water with a velocity of its own
/// @returns whether any particle was in contact
template <class G, int D = G::dim>
bool add_contact_forces(const Mesh<D>& mesh, const std::vector<Run>& runs, const Movers& movers,
                        std::span<const Vector<D>> velocity, double dt, Particles<D>& particles, Contact<D>& contact,
                        std::span<Vector<D>> forces, const WaterBeside<D>* water = nullptr);
} // namespace mpm::contact
