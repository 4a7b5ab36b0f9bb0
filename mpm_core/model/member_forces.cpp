#include "model/member_forces.h"

#include "model/bond.h"

#include <algorithm>
#include <cmath>

namespace mpm::model
{
namespace
{
/// A segment as it is now.
template <int D>
struct Segment
{
  Vector<D> along; ///< unit vector
  double length;   ///< [m]
};

template <int D>
Segment<D> segment_of(const Member<D>& member, std::size_t k)
{
  Vector<D> edge;
  for (int a = 0; a < D; ++a)
    edge[a] = member.positions[k + 1][a] - member.positions[k][a];
  const double length = norm<D>(edge);
  for (double& component : edge)
    component /= length;
  return {edge, length};
}

/// The angle from one direction to another, counterclockwise.
double angle_between(const Vector<2>& from, const Vector<2>& to)
{
  return std::atan2(from[0] * to[1] - from[1] * to[0], dot<2>(from, to));
}

/// Length over which the curvature at inner node k + 1 acts.
template <int D>
double length_of_bend(const Member<D>& member, std::size_t k)
{
  return 0.5 * (member.initial_lengths[k] + member.initial_lengths[k + 1]);
}

/// Whether nodes k to last are in soil: a part that hangs in the air carries nothing.
template <int D>
bool carries(const Member<D>& member, std::size_t first, std::size_t last)
{
  for (std::size_t k = first; k <= last; ++k)
    if (!member.is_in_soil[k])
      return false;
  return true;
}

/// Updates the axial forces to the present lengths of the segments, within their strength and that of the bond.
template <int D>
void strain_segments(Member<D>& member, const std::vector<Segment<D>>& now)
{
  const MemberProperties& of = member.properties;
  BondedBar bar;
  for (std::size_t k = 0; k < now.size(); ++k)
  {
    const bool is_whole = carries<D>(member, k, k + 1);
    bar.stiffness.push_back(of.axial_stiffness / member.initial_lengths[k]);
    bar.force.push_back(bar.stiffness[k] * (now[k].length - member.free_lengths[k]));
    bar.least.push_back(is_whole ? -of.compressive_strength : 0);
    bar.largest.push_back(is_whole ? of.tensile_strength : 0);
  }
  if (std::isfinite(of.bond_strength))
  {
    bar.bond_strength =
        bond_strengths(member.initial_lengths, of.bond_strength, of.has_free_length, of.connected, of.fixed_end);
    member.axial_force = forces_with_slip(bar);
  }
  else
    for (std::size_t k = 0; k < now.size(); ++k)
      member.axial_force[k] = std::clamp(bar.force[k], bar.least[k], bar.largest[k]);
  for (std::size_t k = 0; k < now.size(); ++k)
    if (member.axial_force[k] != bar.force[k])
      member.free_lengths[k] = now[k].length - member.axial_force[k] / bar.stiffness[k];
}

/// Adds the internal forces of the moment at inner node k + 1: M times the derivatives of the angle there.
void bend_node(Member<2>& member, std::size_t k, std::vector<Vector<2>>& internal)
{
  const MemberProperties& of = member.properties;
  const Segment<2> before = segment_of(member, k), after = segment_of<2>(member, k + 1);
  const double stiffness = of.bending_stiffness / length_of_bend<2>(member, k);
  const double angle = angle_between(before.along, after.along);
  const double elastic = stiffness * (angle - member.free_angles[k]);
  const double moment = carries(member, k, k + 2) ? std::clamp(elastic, -of.plastic_moment, of.plastic_moment) : 0;
  if (moment != elastic)
    member.free_angles[k] = angle - moment / stiffness;
  member.moments[k] = moment;
  const auto turn = [&](const Segment<2>& segment, std::size_t first, double sign)
  {
    const Vector<2> across{-segment.along[1], segment.along[0]};
    for (int a = 0; a < 2; ++a)
    {
      const double force = sign * moment * across[a] / segment.length;
      internal[first][a] -= force;
      internal[first + 1][a] += force;
    }
  };
  turn(after, k + 1, 1);
  turn(before, k, -1);
}
} // namespace

template <int D>
Member<D> make_member(std::string name, const MemberProperties& properties, std::vector<Vector<D>> positions,
                      std::vector<double> axial_force, std::vector<double> moments)
{
  Member<D> member{};
  member.name = std::move(name);
  member.properties = properties;
  member.positions = std::move(positions);
  member.axial_force = std::move(axial_force);
  member.moments = std::move(moments);
  const std::size_t segments = member.positions.size() - 1;
  for (std::size_t k = 0; k < segments; ++k)
  {
    const double length = segment_of<D>(member, k).length;
    member.initial_lengths.push_back(length);
    member.free_lengths.push_back(length * (1 - member.axial_force[k] / properties.axial_stiffness));
  }
  if constexpr (D == 2)
    for (std::size_t k = 0; k < member.moments.size(); ++k)
      member.free_angles.push_back(angle_between(segment_of<D>(member, k).along, segment_of<D>(member, k + 1).along) -
                                   member.moments[k] * length_of_bend<D>(member, k) / properties.bending_stiffness);
  member.is_in_soil.assign(member.positions.size(), 1);
  member.cells.assign(member.positions.size(), none);
  member.hosts.resize(member.positions.size());
  return member;
}

template <int D>
std::vector<Vector<D>> internal_forces(Member<D>& member)
{
  std::vector<Vector<D>> internal(member.positions.size());
  std::vector<Segment<D>> now;
  for (std::size_t k = 0; k + 1 < member.positions.size(); ++k)
    now.push_back(segment_of<D>(member, k));
  strain_segments<D>(member, now);
  for (std::size_t k = 0; k < now.size(); ++k)
    for (int a = 0; a < D; ++a)
    {
      internal[k][a] -= member.axial_force[k] * now[k].along[a];
      internal[k + 1][a] += member.axial_force[k] * now[k].along[a];
    }
  if constexpr (D == 2)
    for (std::size_t k = 0; k < member.moments.size(); ++k)
      bend_node(member, k, internal);
  return internal;
}

template <int D>
std::vector<double> stiffness_rows(const Member<D>& member)
{
  std::vector<double> rows(member.positions.size(), 0);
  for (std::size_t k = 0; k + 1 < rows.size(); ++k)
    for (const std::size_t n : {k, k + 1})
      rows[n] += 2 * member.properties.axial_stiffness / member.initial_lengths[k];
  for (std::size_t k = 0; k < member.moments.size(); ++k)
  {
    const double before = 1 / member.initial_lengths[k], after = 1 / member.initial_lengths[k + 1];
    const double stiffness = member.properties.bending_stiffness / length_of_bend<D>(member, k);
    const double all = 2 * (before + after);
    rows[k] += stiffness * before * all;
    rows[k + 1] += stiffness * (before + after) * all;
    rows[k + 2] += stiffness * after * all;
  }
  return rows;
}

#define INSTANTIATE(D)                                                                                                 \
  template Member<D> make_member<D>(std::string, const MemberProperties&, std::vector<Vector<D>>, std::vector<double>, \
                                    std::vector<double>);                                                              \
  template std::vector<Vector<D>> internal_forces<D>(Member<D>&);                                                      \
  template std::vector<double> stiffness_rows<D>(const Member<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::model
