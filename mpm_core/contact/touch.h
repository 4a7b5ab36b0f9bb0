#pragma once
/// @file
/// Functions of both schemes for a particle at a rigid surface: its size, its slip, and its force on the surface.

#include "contact/contact.h"

#include <algorithm>
#include <cmath>

namespace mpm::contact
{
/// The cube, or square, as large as a particle [m^D].
template <class G>
double particle_cube(const Particles<G::dim>& particles, Index p)
{
  return particles.volume[p] / (G::has_hoop ? particles.position[0][p] : 1);
}

/// Area of surface that a touching particle covers [m2]; per metre or per radian in two dimensions.
/// @param normal_r  component of the surface's normal away from the axis, for axial symmetry: the surface is nearer to
///                  the axis than the particle, or farther from it
template <class G>
double particle_area(const Particles<G::dim>& particles, Index p, double radius, double normal_r)
{
  if constexpr (G::dim == 3)
    return 4 * radius * radius;
  else
    return 2 * radius * (G::has_hoop ? particles.position[0][p] - radius * normal_r : 1);
}

/// Area of the surface on which the strength of a particle's soil acts that does not depend on pressure, over the area
/// of the particle: 1 where it just touches, 2 where its centre is on the surface, 0 from twice its radius on.
///
/// Soil that lies on a surface fills the space up to it, but its particles, in layers at different heights, do not all
/// touch: the areas of those that do are 0.5 to 0.85 of the surface. With the weights (2 - d / r) / (2 r) over the
/// distance d, whose integral is 1, the volumes of all that are near sum up to the area, whatever their heights.
inline double covered_part(double distance, double radius) { return std::clamp(2 - distance / radius, 0.0, 2.0); }

/// Whether a cube with this side is smaller: compared by volumes, since roots take their time.
template <int D>
bool fits(double side, double volume)
{
  return side <= 0 || (D == 3 ? side * side * side : side * side) < volume;
}

/// Speed of the fastest node of a cell [m/s].
template <int D>
double fastest_node(const Mesh<D>& mesh, Index cell, std::span<const Vector<D>> velocity)
{
  double fastest = 0;
  for (Index node : mesh.cells[static_cast<std::size_t>(cell)])
  {
    const Vector<D>& v = velocity[static_cast<std::size_t>(node)];
    fastest = std::max(fastest, dot<D>(v, v));
  }
  return std::sqrt(fastest);
}

/// The largest particle of a run, and how far any moves in a step.
struct Extremes
{
  double cube;   ///< [m^D]
  double motion; ///< [m]
};

template <class G, int D = G::dim>
Extremes extremes_of(const Mesh<D>& mesh, const Run& run, std::span<const Vector<D>> velocity, double dt,
                     const Particles<D>& particles)
{
  Extremes extremes{0, dt * fastest_node<D>(mesh, run.cell, velocity)};
  for (Index p = run.first; p < run.last; ++p)
    extremes.cube = std::max(extremes.cube, particle_cube<G>(particles, p));
  return extremes;
}

/// Whether any particle of a run can be near: not if the largest would not be where the cell, and the step, bring it
/// nearest. Most cells that a surface may reach before their bounds are found again are not at it now.
/// @param gap  smallest possible distance of the cell from the surface at the end of the step, if its nodes rest [m]
template <int D>
bool may_be_near(const Extremes& extremes, double gap)
{
  return fits<D>(gap - extremes.motion, extremes.cube);
}

/// The part of a vector along a surface.
template <int D>
Vector<D> tangential(Vector<D> v, const Vector<D>& normal)
{
  const double along = dot<D>(v, normal);
  for (int i = 0; i < D; ++i)
    v[i] -= along * normal[i];
  return v;
}

/// What pore water does to the friction of a particle.
struct WaterShare
{
  double fraction = 0;     ///< of the normal force that the water carries; negative under suction
  double per_pressure = 0; ///< its derivative by the pore pressure [1/Pa]
};

/// The part of the normal force by which there is friction: what the grains carry (Terzaghi 1936).
inline double carried_by_grains(const WaterShare& water) { return std::max(0.0, 1 - water.fraction); }

/// Friction: adds a displacement along the surface to the elastic slip and returns it to the cone.
/// @param longest  slip at which the spring's force is the shear strength
/// @returns whether the particle sticks
template <int D>
bool update_slip(const Vector<D>& normal, const Vector<D>& increment, double longest, Vector<D>& slip)
{
  for (int i = 0; i < D; ++i)
    slip[i] += increment[i];
  slip = tangential<D>(slip, normal);
  const double length = norm<D>(slip), scale = length > longest ? longest / length : 1;
  for (double& component : slip)
    component *= scale;
  return scale == 1;
}

/// The particles' field with a name; null for an empty one.
template <int D>
std::vector<Column>* columns_of(Particles<D>& particles, const std::string& name)
{
  for (AddedField& field : particles.added)
    if (!name.empty() && field.name == name)
      return &field.columns;
  return nullptr;
}

/// Whether a particle is tied to a surface.
inline bool is_tied(const std::vector<Column>& bonds, Index p) { return bonds[0][p] > 0; }

/// The point of the body that a particle is tied to, where it was at the start [m].
template <int D>
Vector<D> anchor_of(const std::vector<Column>& bonds, Index p)
{
  Vector<D> anchor;
  for (std::size_t i = 0; i < D; ++i)
    anchor[i] = bonds[i + 1][p];
  return anchor;
}

/// Adds a force on a particle to what the surface feels.
template <int D>
void react(const Vector<D>& force, const Vector<D>& arm, Reaction<D>& reaction)
{
  const Vector<3> moment = cross(in_space<D>(arm), in_space<D>(force));
  for (int i = 0; i < D; ++i)
    reaction.force[i] -= force[i];
  for (std::size_t i = 0; i < 3; ++i)
    reaction.moment[i] -= moment[i];
}
} // namespace mpm::contact
