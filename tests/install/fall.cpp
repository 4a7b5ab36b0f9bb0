/// A block of soil that falls for 0.1 s, by the installed core.

#include "explicit/run.h"
#include "particles/seed.h"

#include <cstdio>

using namespace mpm::explicit_scheme;

int main(int argc, char** argv)
{
  MPI_Init(&argc, &argv);
  // A square of 1 m, cut in two triangles
  const std::vector<double> points{0, 0, 1, 0, 0, 1, 1, 1};
  const std::vector<Index> cells{0, 1, 2, 1, 3, 2};
  Model<PlaneStrain> model;
  model.mesh = make_mesh<2>({points, cells, {}, {}, {}, {}, {}, {}}, 0);
  model.exchange = make_node_exchange(model.mesh, MPI_COMM_SELF);
  set_laws(model, {LinearElastic{1e6, 0.3}});
  // One particle of 2000 kg/m3 in each triangle
  seed_cells<PlaneStrain>(model.mesh, std::nullopt, 1, {0, 2000.0}, 0, model.particles);
  model.gravity = {0, -9.81};
  RunOptions run;
  run.until = 0.1;
  run_explicit(model, ExplicitOptions{}, run);
  const Diagnostics report = diagnostics(model);
  std::printf("%.12g %.12g\n", report.mass, report.momentum[1]);
  MPI_Finalize();
}
