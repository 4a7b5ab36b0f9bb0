#pragma once
/// @file
/// Rigid bodies that touch one another: impulses at the end of a step, each of which only takes energy out.
///
/// A ball touches another surface at one point. Where they touch at a step's start and approach one another after all
/// forces, the impulse p_n = -(1 + e) v_n / (n.W n), with the inverse mass W of both at that point, ends the approach;
/// then one against the sliding, of mu p_n at most. Impulses of all points follow one another until none approaches.
/// Momentum and angular momentum are kept to round-off. The restitution e counts no velocity that the forces of the
/// step gave, so that a body at rest rests. Bodies are the same on all ranks, and so is the result.

#include "contact/contact.h"

namespace mpm::contact
{
/// Brings the bodies to velocities at which none of those that touch approach one another.
/// @pre velocities are those after the forces of the step, places still those at its start
template <int D>
void resolve_collisions(const std::vector<Collision>& collisions, std::vector<Contact<D>>& contacts);

/// Distance of a ball from another surface where both are now; below zero where they overlap [m].
template <int D>
double distance_between(const Contact<D>& ball, const Contact<D>& other);
} // namespace mpm::contact
