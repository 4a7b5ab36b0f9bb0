/// Contact looks only at the parts of a surface that a particle can reach. Its forces are those of a search of
/// everything.

#include "boxes.h"
#include "sheets.h"

#include "contact/contact.h"
#include "contact/end_of_step.h"
#include "particles/seed.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace mpm::contact;

namespace
{
/// A closed, bumpy ball of triangles around the centre of the unit cube.
Triangles bumpy_ball(int n)
{
  std::vector<Vector<3>> vertices;
  std::vector<std::array<Index, 3>> triangles;
  const double pi = std::acos(-1);
  const auto add = [&](double polar, double around)
  {
    const double r = 0.22 + 0.03 * std::sin(5 * polar) * std::cos(4 * around);
    vertices.push_back({0.5 + r * std::sin(polar) * std::cos(around), 0.5 + r * std::sin(polar) * std::sin(around),
                        0.5 + r * std::cos(polar)});
  };
  for (int j = 1; j < n; ++j)
    for (int i = 0; i < 2 * n; ++i)
      add(pi * j / n, pi * i / n);
  add(0, 0);
  add(pi, 0);
  const auto at = [n](int j, int i) { return static_cast<Index>((j - 1) * 2 * n + i % (2 * n)); };
  for (int i = 0; i < 2 * n; ++i)
  {
    for (int j = 1; j + 1 < n; ++j)
    {
      triangles.push_back({at(j, i), at(j + 1, i), at(j + 1, i + 1)});
      triangles.push_back({at(j, i), at(j + 1, i + 1), at(j, i + 1)});
    }
    triangles.push_back({static_cast<Index>(vertices.size() - 2), at(1, i), at(1, i + 1)});
    triangles.push_back({static_cast<Index>(vertices.size() - 1), at(n - 1, i + 1), at(n - 1, i)});
  }
  return make_triangles(std::move(vertices), std::move(triangles));
}

/// A wavy sheet across the unit cube, which does not reach its sides: it goes on straight beyond its border.
Triangles waves(int n)
{
  return sheet(n, 0.2, 0.6 / n, [](double x, double y) { return 0.5 + 0.1 * std::sin(9 * x) * std::cos(7 * y); });
}

Polyline wavy_line(int n, bool closed)
{
  Polyline line{{}, closed};
  for (int k = 0; k < n; ++k)
  {
    const double t = 2 * std::acos(-1) * k / n, r = 0.25 + 0.05 * std::sin(5 * t);
    line.points.push_back(closed ? Vector<2>{0.5 + r * std::cos(t), 0.5 - r * std::sin(t)}
                                 : Vector<2>{0.1 + 0.8 * k / n, 0.5 + 0.1 * std::sin(3 * t)});
  }
  return line;
}

/// Another strength for each part of the surface, so that forces show which one they were found on.
template <int D>
std::vector<Resistance> strengths_of(const Surface<D>& surface)
{
  std::size_t parts = 1;
  if constexpr (D == 2)
  {
    if (const auto* line = std::get_if<Polyline>(&surface))
      parts = line->points.size();
  }
  else if (const auto* triangles = std::get_if<Triangles>(&surface))
    parts = triangles->triangles.size();
  std::vector<Resistance> strengths;
  for (std::size_t k = 0; k < parts; ++k)
    strengths.push_back({0.2 + 0.2 * static_cast<double>(k) / static_cast<double>(parts), 0, 1e-3});
  return strengths;
}

template <int D>
Contact<D> moving(const Surface<D>& surface)
{
  RigidBody<D> body{};
  for (int i = 0; i < D; ++i)
    body.centre[i] = 0.45;
  body.prescribed_velocity = {{0.0}, {Vector<D>{}}};
  body.prescribed_velocity.values[0][0] = 0.7;
  body.prescribed_spin = {{0.0}, {{0, 0, 2.0}}};
  body.force = {{0.0}, {Vector<D>{}}};
  return {surface, strengths_of<D>(surface), 0.2, body, "slip", ""};
}

/// Forgets what is known of the surface: all particles are then looked at, and all of the surface for each.
template <int D>
void forget(Contact<D>& contact)
{
  for (CellBound<D>& bound : contact.bounds)
    bound = {0, 1e3};
  contact.parts.clear();
}

template <int D>
void compare(const Surface<D>& surface, int cells, int per_cell)
{
  using G = Cartesian<D>;
  const Mesh<D> mesh = mpm::test::box<D>(cells, 0.2).mesh();
  Particles<D> particles;
  seed_cells<G>(mesh, {}, per_cell, {0, 2000.0}, 0, particles);
  add_field<D>(particles, {"slip", "m", "elastic slip", 0, {}}, D);
  std::vector<Run> runs;
  for (Index p = 0; p < particles.size(); ++p)
    if (runs.empty() || runs.back().cell != particles.cell[p])
      runs.push_back({p, p + 1, particles.cell[p], 0});
    else
      runs.back().last = p + 1;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> speed(-1, 1);
  std::vector<Vector<D>> velocity(mesh.points.size());
  for (Vector<D>& v : velocity)
    for (double& component : v)
      component = speed(random);
  const std::vector<Index> field_of_law{0};
  Contact<D> quick = moving<D>(surface), thorough = quick;
  Particles<D> other = particles;
  const double dt = 1e-3;
  int touching = 0;
  for (int step = 0; step < 30; ++step)
  {
    std::vector<Vector<D>> forces(velocity.size()), expected(velocity.size());
    begin_step<D>(mesh, {step * dt, dt}, quick);
    begin_step<D>(mesh, {step * dt, dt}, thorough);
    forget(thorough);
    add_contact_forces<G, D>(mesh, runs, {field_of_law, 0}, velocity, dt, particles, quick, forces);
    add_contact_forces<G, D>(mesh, runs, {field_of_law, 0}, velocity, dt, other, thorough, expected);
    touching += quick.reaction.area > 0;
    ASSERT_EQ(forces, expected) << "step " << step;
    ASSERT_EQ(quick.reaction.area, thorough.reaction.area);
    ASSERT_EQ(quick.reaction.energy, thorough.reaction.energy);
    ASSERT_EQ(particles.added[0].columns, other.added[0].columns);
    end_step(dt, quick);
    end_step(dt, thorough);
    thorough.bounds.clear(); // not to be taken for what is known
  }
  EXPECT_EQ(touching, 30);
}
} // namespace

TEST(ContactBounds, ForcesOfABumpyBody) { compare<3>(bumpy_ball(16), 6, 4); }
TEST(ContactBounds, ForcesOfFineTriangles) { compare<3>(bumpy_ball(60), 4, 1); }
TEST(ContactBounds, ForcesOfASheetWithABorder) { compare<3>(waves(14), 6, 4); }
TEST(ContactBounds, ForcesOfAClosedLine) { compare<2>(wavy_line(60, true), 8, 6); }
TEST(ContactBounds, ForcesOfAnOpenLine) { compare<2>(wavy_line(40, false), 8, 6); }
TEST(ContactBounds, ForcesOfBoxes)
{
  compare<2>(Box<2>{{0.3, 0.35}, {0.7, 0.6}}, 8, 6);
  compare<3>(Box<3>{{0.3, 0.35, 0.4}, {0.7, 0.6, 0.6}}, 5, 4);
}
TEST(ContactBounds, ForcesOfBalls) { compare<3>(Ball<3>{{0.5, 0.5, 0.5}, 0.2}, 5, 4); }

TEST(ContactBounds, TouchesAtTheEndOfAStep)
{
  const Mesh<3> mesh = mpm::test::box<3>(6, 0.2).mesh();
  Particles<3> particles;
  seed_cells<Solid>(mesh, {}, 4, {0, 2000.0}, 0, particles);
  Contact<3> contact = moving<3>(bumpy_ball(16));
  begin_step<3>(mesh, {0, 1e-3}, contact);
  const RigidBody<3> end = body_at_end(contact, {0, 1e-3}, false, {contact.body.velocity, contact.body.spin});
  const Vector<3> u{1e-3, -5e-4, 7e-4};
  const double motion = step_travel(contact, end, 1e-3) + norm<3>(u);
  int touching = 0, seen_parts = 0;
  for (Index p = 0; p < particles.size(); ++p)
  {
    const Vector<3> x = at<3>(particles.position, p);
    const Spring spring = spring_of<Solid>(particles, p, {1e6, 3e5}, 0.2);
    const double radius = particle_radius<Solid>(particles, p);
    SeenSurface<3> near = seen_from(contact, particles.cell[p], motion), all{contact, {}, 0, -1};
    EndTouch<3> quick, thorough;
    const bool touches = touches_at_end<3>(near, end, spring, {}, radius, x, u, {}, true, quick);
    ASSERT_EQ(touches, touches_at_end<3>(all, end, spring, {}, radius, x, u, {}, true, thorough));
    ASSERT_EQ(quick.force, thorough.force);
    ASSERT_EQ(quick.stiffness, thorough.stiffness);
    ASSERT_EQ(quick.arm, thorough.arm);
    touching += touches;
    seen_parts += touches && near.within > radius;
  }
  EXPECT_GT(touching, 100);
  EXPECT_GT(seen_parts, 0.9 * touching);
}
