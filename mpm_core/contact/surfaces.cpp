#include "contact/surfaces.h"

#include "base/tensor.h"
#include "contact/triangle_rises.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::contact
{
namespace
{
constexpr double endless = std::numeric_limits<double>::infinity();

template <int D>
Vector<D> scaled(Vector<D> v, double factor)
{
  for (double& component : v)
    component *= factor;
  return v;
}

template <int D>
Distance<D> distance_from(const Plane<D>& plane, const Vector<D>& x)
{
  return {dot<D>(difference<D>(x, plane.point), plane.normal), plane.normal};
}

template <int D>
Distance<D> distance_from(const Ball<D>& ball, const Vector<D>& x)
{
  const Vector<D> r = difference<D>(x, ball.centre);
  const double length = norm<D>(r);
  return {length - ball.radius, length > 0 ? scaled<D>(r, 1 / length) : Vector<D>{1}};
}

template <int D>
Distance<D> distance_from(const Box<D>& box, const Vector<D>& x)
{
  Vector<D> beyond, outside{};
  int axis = 0; // of the nearest face
  for (int i = 0; i < D; ++i)
  {
    beyond[i] = std::max(box.lower[i] - x[i], x[i] - box.upper[i]);
    outside[i] = x[i] - std::clamp(x[i], box.lower[i], box.upper[i]);
    if (beyond[i] > beyond[axis])
      axis = i;
  }
  if (const double length = norm<D>(outside); length > 0)
    return {length, scaled<D>(outside, 1 / length)};
  Vector<D> normal{};
  normal[axis] = 2 * x[axis] > box.lower[axis] + box.upper[axis] ? 1 : -1;
  return {beyond[axis], normal};
}

Distance<2> distance_at(const Polyline& line, const NearestOnLine& nearest)
{
  const Vector<2> out = outward_at(line, nearest);
  const double length = std::sqrt(nearest.squared);
  const Index part = part_at(line, nearest);
  if (length == 0)
    return {0, scaled<2>(out, 1 / norm<2>(out)), part};
  const double sign = dot<2>(out, nearest.offset) < 0 ? -1 : 1;
  return {sign * length, scaled<2>(nearest.offset, sign / length), part};
}

Distance<3> distance_at(const Triangles& triangles, const NearestOnTriangles& nearest)
{
  const Vector<3> out = outward_at(triangles, nearest);
  const double height = dot<3>(out, nearest.offset), length = std::sqrt(nearest.squared);
  const Index part = part_at(triangles, nearest);
  if (length == 0 || is_at_border(triangles, nearest))
    return {height, out, part};
  const double sign = height < 0 ? -1 : 1;
  return {sign * length, scaled<3>(nearest.offset, sign / length), part};
}

Distance<2> distance_from(const Polyline& line, const Vector<2>& x) { return distance_at(line, nearest_on(line, x)); }

Distance<3> distance_from(const Triangles& triangles, const Vector<3>& x)
{
  return distance_at(triangles, nearest_on(triangles, x));
}

Distance<3> distance_from(const Revolved& solid, const Vector<3>& x)
{
  const Vector<3> arm = difference<3>(x, solid.point);
  const double z = dot<3>(arm, solid.axis);
  const Vector<3> radial = difference<3>(arm, scaled<3>(solid.axis, z));
  const double r = norm<3>(radial);
  const auto [value, normal, part] = distance_from(solid.section, {r, z});
  // On the axis any radial direction is as good; its part of the normal is zero but for the inside of the solid.
  const Vector<3> out = r > 0 ? scaled<3>(radial, 1 / r) : Vector<3>{};
  Vector<3> along;
  for (std::size_t i = 0; i < 3; ++i)
    along[i] = normal[0] * out[i] + normal[1] * solid.axis[i];
  const double length = norm<3>(along);
  return {value, length > 0 ? scaled<3>(along, 1 / length) : solid.axis, part};
}

template <int D>
double reach_of(const Plane<D>&, const Vector<D>&)
{
  return endless;
}

template <int D>
double reach_of(const Ball<D>& ball, const Vector<D>& centre)
{
  return norm<D>(difference<D>(ball.centre, centre)); // about its own centre it stays what it is
}

template <int D>
double reach_of(const Box<D>& box, const Vector<D>& centre)
{
  Vector<D> arm;
  for (int i = 0; i < D; ++i)
    arm[i] = std::max(std::abs(box.lower[i] - centre[i]), std::abs(box.upper[i] - centre[i]));
  return norm<D>(arm);
}

double reach_of(const Polyline& line, const Vector<2>& centre)
{
  double reach = line.closed ? 0 : endless;
  for (const Vector<2>& point : line.points)
    reach = std::max(reach, norm<2>(difference<2>(point, centre)));
  return reach;
}

double reach_of(const Revolved& solid, const Vector<3>& centre)
{
  const double away = norm<3>(difference<3>(solid.point, centre));
  double reach = 0;
  for (const Vector<2>& point : solid.section.points)
    reach = std::max(reach, norm<2>(point));
  return away + reach;
}

double reach_of(const Triangles& triangles, const Vector<3>& centre)
{
  double reach = 0;
  for (std::size_t v = 0; v < triangles.vertices.size(); ++v)
    reach = std::max(reach, triangles.at_border[v] ? endless : norm<3>(difference<3>(triangles.vertices[v], centre)));
  return reach;
}
} // namespace

template <int D>
double rotation_reach(const Surface<D>& surface, const Vector<D>& centre)
{
  const auto of = [&centre](const auto& shape)
  {
    if constexpr (requires { reach_of(shape, centre); })
      return reach_of(shape, centre);
    else
      return reach_of<D>(shape, centre);
  };
  return std::visit(of, surface);
}

template <int D>
Distance<D> distance(const Surface<D>& surface, const Vector<D>& x)
{
  const auto from = [&x](const auto& shape)
  {
    if constexpr (requires { distance_from(shape, x); })
      return distance_from(shape, x);
    else
      return distance_from<D>(shape, x);
  };
  return std::visit(from, surface);
}

template <int D>
std::optional<Distance<D>> distance_within(const Surface<D>& surface, const Vector<D>& x, std::span<const Index> parts,
                                           double limit, [[maybe_unused]] Index& start)
{
  const auto* divided = std::get_if<std::conditional_t<D == 2, Polyline, Triangles>>(&surface);
  if (!divided)
    return distance<D>(surface, x);
  const auto nearest = [&]
  {
    if constexpr (D == 3)
      return nearest_from(*divided, x, parts, limit, start);
    else
      return nearest_on(*divided, x, parts, limit * limit);
  }();
  return nearest.squared < limit * limit ? std::optional(distance_at(*divided, nearest)) : std::nullopt;
}

template Distance<2> distance<2>(const Surface<2>&, const Vector<2>&);
template Distance<3> distance<3>(const Surface<3>&, const Vector<3>&);
template std::optional<Distance<2>> distance_within<2>(const Surface<2>&, const Vector<2>&, std::span<const Index>,
                                                       double, Index&);
template std::optional<Distance<3>> distance_within<3>(const Surface<3>&, const Vector<3>&, std::span<const Index>,
                                                       double, Index&);
template double rotation_reach<2>(const Surface<2>&, const Vector<2>&);
template double rotation_reach<3>(const Surface<3>&, const Vector<3>&);
} // namespace mpm::contact
