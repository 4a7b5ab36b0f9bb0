#pragma once
/// @file
/// Contact at the end of a step, for the implicit scheme.
///
/// A particle moves by u, the body to its place at the step's end. There its gap g, the normal n and the motion w of
/// the particle relative to the body give
///
///     f = kappa (<-g> n - s),   kappa = 50 beta M A_p / (2 r_p),   |kappa s| <= mu kappa <-g> + a A_p,
///     <-g> = d ln(1 + exp(-g / d)),   d = 1e-5 r_p,
///
/// with the modulus M of compression without lateral strain, and the slip s = P (s_0 + w) along the surface, P = 1 - n
/// n^T, before it is returned to the cone of friction. With beta = 0.2 the spring is ten times as stiff as the
/// particle. A particle that is tied to the body has the force -kappa s of all its motion relative to it.
/// The onset is smooth so that short enough steps always converge: a kink would look the same to any step.
/// The tangent is that of this force; the curvature H = dn/dx of the surface is found by differences of its normal.

#include "contact/contact.h"

namespace mpm::contact
{
/// The place and velocities of a body at the end of a step, by its prescribed motion; at rest where there is no time.
template <int D>
RigidBody<D> body_at_end(const Contact<D>& contact, const TimeStep& step, bool at_rest);

/// The spring between a particle and a surface.
struct Spring
{
  double radius;    ///< of the particle [m]
  double area;      ///< that it covers [m2]
  double stiffness; ///< kappa [N/m]
  double shear;     ///< kappa_t, along the surface [N/m]
};

/// The spring of a particle.
/// @param compression  modulus of its soil without lateral strain [Pa]
/// @param shear        modulus [Pa]
template <class G>
Spring spring_of(const Particles<G::dim>& particles, Index p, double compression, double shear, double penalty);

/// A particle that touches a surface at the end of a step.
template <int D>
struct EndTouch
{
  Vector<D> force{};     ///< on the particle [N]
  Matrix<D> stiffness{}; ///< -df/du; where wanted [N/m]
  Vector<D> slip{};      ///< elastic [m]
  Vector<D> arm{};       ///< from the body's centre to the nearest point of its surface, or to a tied particle [m]
  Vector<D> normal{};    ///< of the surface there
  double depth = 0;      ///< [m]
  bool sticks = true;
};

/// @param x    place of the particle at the step's start [m]
/// @param u    its displacement [m]
/// @param old  elastic slip at the step's start [m]
/// @returns whether it touches
template <int D>
bool touches_at_end(const Contact<D>& contact, const RigidBody<D>& end, const Spring& spring, const Vector<D>& x,
                    const Vector<D>& u, const Vector<D>& old, bool tangent, EndTouch<D>& touch);

/// A particle that is tied to the body, as `touches_at_end`.
/// @param anchor  the point of the body that it is tied to, where it was at the start [m]
template <int D>
EndTouch<D> tied_at_end(const Contact<D>& contact, const RigidBody<D>& end, const Spring& spring, const Vector<D>& x,
                        const Vector<D>& u, const Vector<D>& anchor);
} // namespace mpm::contact
