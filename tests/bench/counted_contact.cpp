/// A layer of soil on ground, whose instructions `tests/bench/contact.py` counts under callgrind.
///
/// Arguments: dimension, height of the layer in cells, and the ground: `nothing`, `plane`, or the number of sides of a
/// terrain's squares over the width of the layer.

#include "../cpp/boxes.h"
#include "../cpp/sheets.h"

#include "explicit/critical_step.h"
#include "explicit/explicit_step.h"
#include "particles/seed.h"

#include <iostream>
#include <numbers>
#include <string>

using namespace mpm::explicit_scheme;

namespace
{
constexpr int cells = 12;    ///< over the width of the layer, which is 1 m
constexpr int per_side = 3;  ///< particles over a cell
constexpr int squares = 708; ///< of the terrain, over its width: 10^6 triangles

/// Height of the terrain [m]: hills two cells high and half the layer long.
double height(double x, double y)
{
  constexpr double pi = std::numbers::pi;
  return 0.17 + 0.04 * std::sin(4 * pi * x) * std::cos(3 * pi * y);
}

/// A terrain around the layer.
/// @param over_layer  sides of squares over its width
Triangles terrain(int over_layer)
{
  const double side = 1.0 / over_layer;
  return sheet(squares, 0.5 - side * squares / 2, side, height);
}

/// Particles in columns that begin on the ground.
template <int D>
void seed(const Mesh<D>& mesh, int high, bool hills, Particles<D>& particles)
{
  const double side = 1.0 / (cells * per_side);
  const int n = cells * per_side, rows = D == 3 ? n : 1;
  std::vector<double> points, volumes;
  std::vector<GlobalIndex> ids;
  for (int j = 0; j < rows; ++j)
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < high * per_side; ++k)
      {
        const double x = side * (i + 0.5), y = side * (j + 0.5);
        points.push_back(x);
        if (D == 3)
          points.push_back(y);
        points.push_back((hills ? height(x, y) + 0.003 : 0.17) + side * (k + 0.5));
        volumes.push_back(std::pow(side, D));
        ids.push_back(static_cast<GlobalIndex>(ids.size()));
      }
  seed_points<D>(mesh, points, volumes, ids, {0, 2000.0}, particles);
  std::ranges::fill(particles.velocity[D - 1], -0.3);
}

/// Adds ground, with friction.
template <int D>
void add_ground(Surface<D> surface, Particles<D>& particles, std::vector<Contact<D>>& contacts)
{
  RigidBody<D> body{};
  body.prescribed_velocity = {{0.0}, {{}}};
  body.prescribed_spin = {{0.0}, {{}}};
  body.force = {{0.0}, {{}}};
  add_field<D>(particles, {"slip", "m", "elastic slip", 0, {}}, D);
  contacts.push_back({std::move(surface), 0.5, 0, 0.2, body, "slip", ""});
}

template <int D>
void run(int high, const std::string& ground)
{
  const auto arrays = mpm::test::box<D>(cells);
  Model<Cartesian<D>> model;
  model.mesh = make_mesh<D>(arrays.input(), 0);
  model.exchange = make_node_exchange<D>(model.mesh, MPI_COMM_SELF);
  set_laws(model, {MohrCoulomb{2e6, 0.33, 1e3, 25.0}});
  const bool hills = ground != "nothing" && ground != "plane";
  seed<D>(model.mesh, high, hills, model.particles);
  std::vector<SupportRequest<D>> requests;
  for (Index side = 1; side <= 2 * (D - 1); ++side)
    requests.push_back({side, true, Vector<D>{}});
  set_supports(model, requests);
  model.gravity[D - 1] = -9.81;
  Vector<D> origin{}, up{};
  origin[D - 1] = 0.17;
  up[D - 1] = 1;
  if (ground == "plane")
    add_ground<D>(Plane<D>{origin, up}, model.particles, model.contacts);
  if constexpr (D == 3)
    if (hills)
      add_ground<D>(terrain(std::stoi(ground)), model.particles, model.contacts);
  prepare(model);
  const double dt = 0.5 * critical_time_step(model);
  ExplicitOptions options;
  for (int step = 0; step < 10; ++step)
    explicit_step(model, options, dt);
  std::cout << model.particles.size() << '\n';
}
} // namespace

int main(int argc, char** argv)
{
  MPI_Init(&argc, &argv);
  const int high = std::stoi(argv[2]);
  if (std::string(argv[1]) == "2")
    run<2>(high, argv[3]);
  else
    run<3>(high, argv[3]);
  MPI_Finalize();
}
