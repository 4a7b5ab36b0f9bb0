#include "boxes.h"
#include "mesh/search.h"
#include "transfer/affine_field.h"
#include "transfer/kinematics.h"
#include "transfer/nodes.h"

#include <gtest/gtest.h>

using namespace mpm::transfer;

namespace
{
/// Particles at random in a mesh, with random masses, velocities, stresses and tractions, sorted.
template <int D>
Particles<D> random_particles(const Mesh<D>& mesh, Index size)
{
  std::mt19937 random(21);
  std::uniform_real_distribution<double> unit(0, 1);
  Particles<D> particles;
  resize(particles, size);
  require(particles.traction, particles.id.size());
  for (Index p = 0; p < size; ++p)
  {
    particles.id[p] = p;
    particles.mass[p] = 1 + unit(random);
    particles.volume[p] = 1 + unit(random);
    for (int i = 0; i < D; ++i)
    {
      particles.position[i][p] = unit(random);
      particles.velocity[i][p] = unit(random);
      particles.traction[i][p] = unit(random);
    }
    for (auto& column : particles.stress)
      column[p] = unit(random);
    particles.cell[p] = find_cell_in_bins<D>(mesh, at<D>(particles.position, p));
  }
  sort_by_cell(particles, mesh.n_cells(), 1);
  return particles;
}

template <int D>
std::vector<Vector<D>> random_vectors(std::size_t n, unsigned seed, double size)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-size, size);
  std::vector<Vector<D>> vectors(n);
  for (auto& v : vectors)
    for (double& component : v)
      component = unit(random);
  return vectors;
}

template <int D>
std::vector<NodeSums<D>> mapped(const Mesh<D>& mesh, const Particles<D>& particles)
{
  std::vector<Run> runs;
  find_runs(particles, particles.size(), runs);
  std::vector<CellMoments<Cartesian<D>>> moments(mesh.cells.size(), CellMoments<Cartesian<D>>{});
  std::vector<TractionMoments<D>> tractions(mesh.cells.size(), TractionMoments<D>{});
  for (const Run& run : runs)
  {
    add_moments<Cartesian<D>>(particles, run.first, run.last, mesh.shapes[run.cell], moments[run.cell]);
    add_moments<D>(particles, run.first, run.last, mesh.shapes[run.cell], tractions[run.cell]);
  }
  std::vector<NodeSums<D>> nodes(mesh.points.size());
  const auto stress_of = [&](Index c) { return moments[c].stress; };
  NodeExchange exchange; // one rank: nothing is shared
  scatter<Cartesian<D>>(mesh, exchange, mpm::test::whole(mesh), moments, stress_of, tractions, {}, nodes);
  return nodes;
}

/// The same sums, particle by particle and node by node: (11), (14), (15).
template <int D>
std::vector<NodeSums<D>> mapped_one_by_one(const Mesh<D>& mesh, const Particles<D>& particles)
{
  std::vector<NodeSums<D>> nodes(mesh.points.size(), NodeSums<D>{});
  for (Index p = 0; p < particles.size(); ++p)
  {
    const auto& shape = mesh.shapes[particles.cell[p]];
    const auto n = shape_functions<D>(shape, at<D>(particles.position, p));
    for (int k = 0; k <= D; ++k)
    {
      NodeSums<D>& node = nodes[mesh.cells[particles.cell[p]][k]];
      node.mass += particles.mass[p] * n[k];
      for (int i = 0; i < D; ++i)
      {
        node.momentum[i] += particles.mass[p] * n[k] * particles.velocity[i][p];
        node.traction[i] += n[k] * particles.traction[i][p];
        for (int j = 0; j < D; ++j)
          node.internal[i] += particles.volume[p] * shape.gradient[k][j] *
                              particles.stress[stress_component<D>[symmetric_index<D>(i, j)]][p];
      }
    }
  }
  return nodes;
}
} // namespace

template <class T>
class NodesTest : public testing::Test
{
};
template <int N>
using Dimension = std::integral_constant<int, N>;
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(NodesTest, Dimensions);

TYPED_TEST(NodesTest, MomentsGiveTheSumsOverParticles)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(3, 0.15).mesh();
  const Particles<D> particles = random_particles(mesh, 400);
  const auto nodes = mapped(mesh, particles), expected = mapped_one_by_one(mesh, particles);
  for (std::size_t i = 0; i < nodes.size(); ++i)
  {
    EXPECT_NEAR(nodes[i].mass, expected[i].mass, 1e-12);
    for (int a = 0; a < D; ++a)
    {
      EXPECT_NEAR(nodes[i].momentum[a], expected[i].momentum[a], 1e-12);
      EXPECT_NEAR(nodes[i].internal[a], expected[i].internal[a], 1e-11);
      EXPECT_NEAR(nodes[i].traction[a], expected[i].traction[a], 1e-12);
    }
  }
}

TYPED_TEST(NodesTest, MappingConservesSums)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(3, 0.15).mesh();
  const Particles<D> particles = random_particles(mesh, 400);
  double mass = 0;
  Vector<D> momentum{}, internal{}, traction{};
  for (const auto& node : mapped(mesh, particles))
  {
    mass += node.mass;
    for (int a = 0; a < D; ++a)
    {
      momentum[a] += node.momentum[a];
      internal[a] += node.internal[a];
      traction[a] += node.traction[a];
    }
  }
  for (Index p = 0; p < particles.size(); ++p)
  {
    mass -= particles.mass[p];
    for (int a = 0; a < D; ++a)
    {
      momentum[a] -= particles.mass[p] * particles.velocity[a][p];
      traction[a] -= particles.traction[a][p];
    }
  }
  EXPECT_NEAR(mass, 0, 1e-10);
  for (int a = 0; a < D; ++a)
  {
    EXPECT_NEAR(momentum[a], 0, 1e-10);
    EXPECT_NEAR(traction[a], 0, 1e-10);
    EXPECT_NEAR(internal[a], 0, 1e-10); // the gradients of the shape functions add up to zero
  }
}

TYPED_TEST(NodesTest, MovedMomentsAreThoseOfTheMovedParticles)
{
  // v_p = flip_fraction v_p + f(x_p), then x_p += u(x_p) with affine f and u: the moments follow without the particles.
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(1).mesh();
  Particles<D> particles = random_particles(mesh, 60);
  const Index cell = particles.cell[0];
  Index last = 0;
  while (last < particles.size() && particles.cell[last] == cell)
    ++last;
  const CellShape<D>& shape = mesh.shapes[cell];
  CellMoments<Cartesian<D>> moments{}, expected{};
  add_moments<Cartesian<D>>(particles, 0, last, shape, moments);
  const std::vector<Vector<D>> change = random_vectors<D>(mesh.points.size(), 22, 1);
  const std::vector<Vector<D>> displacement = random_vectors<D>(mesh.points.size(), 23, 0.1);
  const auto field = [&](const auto& nodal)
  {
    return affine_field<D>(mesh, cell, [&](Index i) -> const Vector<D>& { return nodal[i]; });
  };
  const CellMotion<D> motion{0.7, field(change), field(displacement)};
  move<Cartesian<D>>(moments, motion);
  for (Index p = 0; p < last; ++p)
  {
    const auto n = shape_functions<D>(shape, at<D>(particles.position, p));
    for (int a = 0; a < D; ++a)
    {
      particles.velocity[a][p] *= 0.7;
      for (int k = 0; k <= D; ++k)
      {
        particles.velocity[a][p] += n[k] * change[mesh.cells[cell][k]][a];
        particles.position[a][p] += n[k] * displacement[mesh.cells[cell][k]][a];
      }
    }
  }
  add_moments<Cartesian<D>>(particles, 0, last, shape, expected);
  using Numbers = std::array<double, sizeof(moments) / sizeof(double)>;
  const auto got = std::bit_cast<Numbers>(moments), wanted = std::bit_cast<Numbers>(expected);
  for (std::size_t k = 0; k < got.size(); ++k)
    EXPECT_NEAR(got[k], wanted[k], 1e-12);
  const auto stress = stress_sum<Cartesian<D>>(particles, 0, last);
  for (int k = 0; k < n_symmetric<D>; ++k)
    EXPECT_NEAR(stress[k], wanted[got.size() - n_symmetric<D> + static_cast<std::size_t>(k)], 1e-12);
  take_out(expected, moments);
  for (double left : std::bit_cast<Numbers>(moments))
    EXPECT_NEAR(left, 0, 1e-12);
}

TYPED_TEST(NodesTest, SumsOfFewAndManyParticlesAreThoseOneByOne)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(1).mesh();
  const Particles<D> particles = random_particles(mesh, 60);
  using Numbers = std::array<double, sizeof(CellMoments<Cartesian<D>>) / sizeof(double)>;
  for (Index count = 1; count <= 13; ++count)
  {
    CellMoments<Cartesian<D>> together{}, one_by_one{};
    add_moments<Cartesian<D>>(particles, 3, 3 + count, mesh.shapes[0], together);
    for (Index p = 3; p < 3 + count; ++p)
      add_moments<Cartesian<D>>(particles, p, p + 1, mesh.shapes[0], one_by_one);
    const auto got = std::bit_cast<Numbers>(together), wanted = std::bit_cast<Numbers>(one_by_one);
    for (std::size_t k = 0; k < got.size(); ++k)
      EXPECT_NEAR(got[k], wanted[k], 1e-13) << count;
    EXPECT_NEAR(together.mass, std::accumulate(particles.mass.begin() + 3, particles.mass.begin() + 3 + count, 0.0),
                1e-13);
  }
}

TYPED_TEST(NodesTest, AffineNodalFieldsArriveExactly)
{
  // Positions move with v = A x + b, velocities change by a = A' x + b', exactly at every particle; PIC takes v_i + dt
  // a_i.
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(3, 0.15).mesh();
  Particles<D> particles = random_particles(mesh, 200);
  const Particles<D> before = particles;
  auto affine = [](const Vector<D>& x, double scale)
  {
    Vector<D> v;
    for (int i = 0; i < D; ++i)
      v[i] = scale * (0.3 * i + x[(i + 1) % D] - 0.5 * x[i]);
    return v;
  };
  std::vector<Vector<D>> start, acceleration, velocity;
  for (const auto& x : mesh.points)
  {
    start.push_back(affine(x, 1));
    acceleration.push_back(affine(x, -2));
    velocity.push_back(affine(x, 3));
  }
  const double dt = 1e-3, pic = 0.25;
  std::vector<Vector<D>> change(mesh.points.size()), displacement(mesh.points.size());
  for (std::size_t i = 0; i < change.size(); ++i)
    for (int a = 0; a < D; ++a)
    {
      change[i][a] = dt * acceleration[i][a] + pic * start[i][a];
      displacement[i][a] = dt * velocity[i][a];
    }
  std::vector<Run> runs;
  find_runs(particles, 1000, runs);
  for (const Run& run : runs)
  {
    const auto field = [&](const auto& nodal)
    {
      return affine_field<D>(mesh, run.cell, [&](Index i) -> const Vector<D>& { return nodal[i]; });
    };
    move_particles<D>(particles, run.first, run.last, mesh.shapes[run.cell],
                      {1 - pic, field(change), field(displacement)});
  }
  for (Index p = 0; p < particles.size(); ++p)
  {
    const Vector<D> x = at<D>(before.position, p), v = at<D>(before.velocity, p);
    for (int i = 0; i < D; ++i)
    {
      const double flip = v[i] + dt * affine(x, -2)[i], grid = affine(x, 1)[i] + dt * affine(x, -2)[i];
      EXPECT_NEAR(particles.velocity[i][p], (1 - pic) * flip + pic * grid, 1e-14);
      EXPECT_NEAR(particles.position[i][p], x[i] + dt * affine(x, 3)[i], 1e-15);
    }
  }
}
