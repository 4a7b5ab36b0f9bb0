#pragma once
/// @file
/// Which cells are too far from a rigid surface for their particles to touch it.

#include "contact/contact.h"

namespace mpm::contact
{
/// Finds lower bounds of the gaps in all cells of this rank, for the place where the surface is now, unless those from
/// before still hold.
template <int D>
void keep_clearance(const Mesh<D>& mesh, Contact<D>& contact);

/// Distance from the centre of a cell, over that of its vertices, within which its particles may touch a surface: 1 for
/// their places, 2 for their radius and their motion in a step.
inline constexpr double near_reaches = 3;

/// Whether a particle of a cell may touch the surface before that has travelled so far.
template <int D>
inline bool may_be_near(const CellBound<D>& bound, double travel)
{
  return bound.distance - near_reaches * bound.reach <= travel;
}

/// A point as it lies to the surface at its start.
template <int D>
inline Vector<D> as_at_start(const RigidBody<D>& body, const Vector<D>& x)
{
  Vector<D> arm;
  for (int i = 0; i < D; ++i)
    arm[i] = x[i] - body.displacement[i] - body.centre[i];
  arm = rotated_back<D>(body.rotation, arm);
  for (int i = 0; i < D; ++i)
    arm[i] += body.centre[i];
  return arm;
}

/// A point of the body, given as it was at its start, where it is now.
template <int D>
inline Vector<D> as_it_is(const RigidBody<D>& body, const Vector<D>& x)
{
  Vector<D> arm;
  for (int i = 0; i < D; ++i)
    arm[i] = x[i] - body.centre[i];
  arm = rotated<D>(body.rotation, arm);
  for (int i = 0; i < D; ++i)
    arm[i] += body.centre[i] + body.displacement[i];
  return arm;
}
} // namespace mpm::contact
