#pragma once
/// @file
/// Contact at the end of a step, for the implicit scheme.
///
/// A particle moves by u, the body to its place at the step's end. There its gap g, the normal n and the motion w of
/// the particle relative to the body give
///
///     f = kappa <-g> n - kappa_t s,   <-g> = d ln(1 + exp(-g / d)),   d = 1e-5 r_p,
///     |kappa_t s| <= mu b kappa <-g> + a A_p (1 - g / r_p),
///     kappa = 50 beta M A_p / (2 r_p),   kappa_t = 50 beta G A_p / (2 r_p),
///
/// with the part b of the normal force that the grains carry, 1 without water, and the moduli M of compression without
/// lateral strain and G of shear of the soil in the cell, at least twenty times the pore pressure, and the slip
/// s = P (s_0 + w) along the surface, P = 1 - n n^T, before it is returned to the cone of friction. With beta = 0.2 the
/// springs are ten times as stiff as the particle in compression and in shear; one as stiff as M along the surface of
/// soil that keeps its volume, M >> G, would slip and stick in turns from one iteration to the next. A particle that is
/// tied to the body has the force -kappa s of all its motion relative to it. The radius in g is that at the end, so
/// that the next step begins with the forces with which this one ends; all else of the size is that at the start. The
/// onset is smooth so that short enough steps always converge: a kink would look the same to any step. The tangent is
/// that of this force; the curvature H = dn/dx of the surface is found by differences of its normal.
///
/// The force acts on the soil at the edge of the particle, x - r_p n at the step's start, by the linear functions of
/// the particle's cell, also beyond that cell: there the stress of the soil ends, which balances all of the force then.
/// At the particle's centre its lever would be too short, and the cells at a surface would feel a part of the force
/// only.

#include "contact/touch.h"

#include <span>

namespace mpm::contact
{
/// The place and velocities of a body at the end of a step, by its prescribed motion; at rest where there is no time.
/// @param driven  velocity along axes that are not prescribed, and spin of a body that rotates freely
template <int D>
RigidBody<D> body_at_end(const Contact<D>& contact, const TimeStep& step, bool at_rest, const Motion<D>& driven);

/// A surface as it is seen from a cell: a search finds all that is so near among some of its parts.
template <int D>
struct SeenSurface
{
  const Contact<D>& contact;
  std::span<const Index> parts;
  double within; ///< [m]; where nothing is that near, all of the surface is searched
  Index start;   ///< see `distance_within`
};

/// @param motion  of a place in the cell relative to the surface since the bounds of the cell were found, at most [m]
template <int D>
SeenSurface<D> seen_from(const Contact<D>& contact, Index cell, double motion);

/// Moduli of soil [Pa].
struct ContactModuli
{
  double compression; ///< without lateral strain
  double shear;
};

/// The springs between a particle and a surface.
struct Spring
{
  double radius;    ///< of the particle at the step's start [m]
  double onset;     ///< d [m]
  double area;      ///< that it covers of a surface as far from the axis as itself [m2]
  double by_normal; ///< derivative of the area by the normal's component away from the axis, in axial symmetry
  double stiffness; ///< kappa [N/m]
  double shear;     ///< kappa_t, along the surface [N/m]
};

template <class G>
Spring spring_of(const Particles<G::dim>& particles, Index p, const ContactModuli& moduli, double penalty);

/// The radius of a particle at the end of a step [m].
struct EndRadius
{
  double value;
  double by_volumetric; ///< its derivative by the volumetric strain
  double by_motion;     ///< and by the displacement away from the axis, in axial symmetry
};

/// @param u  displacement of the particle [m]
template <class G>
EndRadius radius_at_end(const Particles<G::dim>& particles, Index p, double volumetric, const Vector<G::dim>& u);

/// The point of a particle that is nearest to a surface at the start of a step [m].
/// @param radius  of the particle [m]
/// @param x       its place [m]
template <int D>
Vector<D> edge_at_start(SeenSurface<D>& seen, double radius, const Vector<D>& x);

/// A particle that touches a surface at the end of a step.
template <int D>
struct EndTouch
{
  Vector<D> force{};     ///< on the particle [N]
  Matrix<D> stiffness{}; ///< -df/du at constant radius; where wanted [N/m]
  Vector<D> by_radius{}; ///< df/dr; likewise
  Vector<D> by_water{};  ///< df/dp of the pore pressure; likewise [m2]
  Vector<D> slip{};      ///< elastic [m]
  Vector<D> arm{};       ///< from the body's centre to the nearest point of its surface, or to a tied particle [m]
  Vector<D> normal{};    ///< of the surface there
  double depth = 0;      ///< [m]
  double area = 0;       ///< of the particle at the surface [m2]
  double covered = 0;    ///< part of the surface on which it resists sliding, see `covered_part` [m2]
  bool presses = true;   ///< whether it touches; otherwise it is near, and only its adhesion acts
  bool sticks = true;
};

/// @param seen    the surface, from the cell of the particle
/// @param water   its share of the normal force
/// @param radius  of the particle at the step's end [m]
/// @param x       place of the particle at the step's start [m]
/// @param u       its displacement [m]
/// @param old     elastic slip at the step's start [m]
/// @returns whether it touches
template <int D>
bool touches_at_end(SeenSurface<D>& seen, const RigidBody<D>& end, const Spring& spring, const WaterShare& water,
                    double radius, const Vector<D>& x, const Vector<D>& u, const Vector<D>& old, bool tangent,
                    EndTouch<D>& touch);

/// A particle that is tied to the body, as `touches_at_end`.
/// @param anchor  the point of the body that it is tied to, where it was at the start [m]
template <int D>
EndTouch<D> tied_at_end(SeenSurface<D>& seen, const RigidBody<D>& end, const Spring& spring, const Vector<D>& x,
                        const Vector<D>& u, const Vector<D>& anchor);
} // namespace mpm::contact
