/// Small explicit steps and one Newton assembly, whose instructions `tests/bench/budget.py` counts under callgrind;
/// `tests/run memcheck` looks at their memory.

#include "../cpp/boxes.h"

#include "explicit/critical_step.h"
#include "explicit/explicit_step.h"
#include "implicit/implicit_step.h"
#include "particles/seed.h"

using namespace mpm::implicit;

namespace
{
/// A heap of soil in a box, that slides: the cells below the diagonal are filled.
template <int D>
Model<Cartesian<D>> heap(int n, int per_cell)
{
  const auto arrays = mpm::test::box<D>(n);
  std::vector<Index> tags;
  for (std::size_t c = 0; c < arrays.cells.size(); c += D + 1)
  {
    double sum = 0; // of all coordinates of the cell's centre
    for (std::size_t k = c; k < c + D + 1; ++k)
      for (int i = 0; i < D; ++i)
        sum += arrays.points[static_cast<std::size_t>(arrays.cells[k] * D + i)] / (D + 1);
    tags.push_back(sum < 1);
  }
  MeshInput<D> input = arrays.input();
  input.cell_tags = tags;
  Model<Cartesian<D>> model;
  model.mesh = make_mesh<D>(input, 0);
  model.exchange = make_node_exchange<D>(model.mesh, MPI_COMM_SELF);
  set_laws(model, {MohrCoulomb{200e3, 0.33, 1e3, 25.0}});
  seed_cells<Cartesian<D>>(model.mesh, 1, per_cell, {0, 2000.0}, 0, model.particles);
  std::vector<SupportRequest<D>> requests;
  for (Index axis = 0; axis < D; ++axis)
    requests.push_back({2 * axis + 1, true, Vector<D>{}});
  set_supports(model, requests);
  model.gravity[D - 1] = -40;
  prepare(model);
  return model;
}

template <class G>
void run_explicit(Model<G> model, bool mixed, int steps)
{
  ExplicitOptions options;
  options.damping = 0.75;
  options.nmd = mixed;
  const double dt = 0.5 * critical_time_step(model);
  for (int step = 0; step < steps; ++step)
    explicit_step(model, options, dt);
}

template <class G>
void assemble(Model<G> model)
{
  ImplicitStep<G> step;
  ImplicitSystem<G::dim> system;
  TangentEntries tangent;
  start_step(model, step, ImplicitOptions{}, 20 * critical_time_step(model));
  number_nodes(model.exchange, model.fields.front(), step, system);
  find_residual(model, step, true);
  find_tangent(model.mesh, model.fields.front(), step, system, tangent);
}
} // namespace

int main(int argc, char** argv)
{
  MPI_Init(&argc, &argv);
  run_explicit(heap<2>(16, 10), false, 40);
  run_explicit(heap<2>(16, 10), true, 40);
  run_explicit(heap<3>(6, 8), false, 10);
  assemble(heap<2>(16, 10));
  MPI_Finalize();
}
