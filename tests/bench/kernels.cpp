/// The kernels of a step one by one, and the memory bandwidth and the arithmetic that bound them.

#include "../cpp/boxes.h"

#include "materials/laws/law.h"
#include "particles/seed.h"
#include "transfer/kinematics.h"
#include "transfer/nodes.h"

#include <benchmark/benchmark.h>

using namespace mpm::transfer;

namespace
{
/// STREAM triad a = b + s c on columns far larger than the caches; 24 bytes per entry, as STREAM counts.
void stream_triad(benchmark::State& state)
{
  const std::size_t n = std::size_t(1) << 24;
  std::vector<double> a(n, 0.0), b(n, 1.0), c(n, 2.0);
  for (auto _ : state)
  {
    double *const x = a.data(), *const y = b.data(), *const z = c.data();
#pragma GCC ivdep
    for (std::size_t i = 0; i < n; ++i)
      x[i] = y[i] + 3.0 * z[i];
    benchmark::ClobberMemory();
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * 24 * n));
}
BENCHMARK(stream_triad)->Unit(benchmark::kMillisecond);

/// Additions and multiplications per second that a core can do: products and sums fused, in registers, as many side by
/// side as it takes to wait for none.
void peak_arithmetic(benchmark::State& state)
{
  constexpr std::size_t lanes = 64;
  constexpr int rounds = 1000;
  std::array<double, lanes> sums{};
  double factor = 0.999, summand = 0.001;
  benchmark::DoNotOptimize(factor);
  benchmark::DoNotOptimize(summand);
  for (auto _ : state)
  {
    std::array<double, lanes> s = sums;
    for (int round = 0; round < rounds; ++round)
      for (std::size_t i = 0; i < lanes; ++i)
        s[i] = s[i] * factor + summand;
    sums = s;
    benchmark::DoNotOptimize(sums);
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * 2 * rounds * static_cast<int>(lanes));
}
BENCHMARK(peak_arithmetic);

/// A filled box with 10 particles per cell (8 in three dimensions) and its runs.
template <int D>
struct Filled
{
  Mesh<D> mesh;
  Particles<D> particles;
  std::vector<Run> runs;

  explicit Filled(int n) : mesh(mpm::test::box<D>(n).mesh())
  {
    particles.state.resize(1);
    seed_cells<Cartesian<D>>(mesh, {}, D == 2 ? 10 : 8, {0, 2000.0}, 0, particles);
    find_runs<D>(particles, 256, runs);
  }
};

void count_particles(benchmark::State& state, Index particles)
{
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations()) * particles);
}

template <int D>
void sum_moments(benchmark::State& state)
{
  Filled<D> box(static_cast<int>(state.range(0)));
  std::vector<CellMoments<Cartesian<D>>> moments(box.mesh.cells.size());
  for (auto _ : state)
    for (const Run& run : box.runs)
      add_moments<Cartesian<D>>(box.particles, run.first, run.last, box.mesh.shapes[run.cell], moments[run.cell]);
  count_particles(state, box.particles.size());
}
BENCHMARK(sum_moments<2>)->Arg(18)->Arg(112);
BENCHMARK(sum_moments<3>)->Arg(5)->Arg(24);

template <int D>
void move(benchmark::State& state)
{
  Filled<D> box(static_cast<int>(state.range(0)));
  const CellMotion<D> rest{1, {}, {}}; // the particles stay where they are
  for (auto _ : state)
    for (const Run& run : box.runs)
      benchmark::DoNotOptimize(move_particles<D>(box.particles, run.first, run.last, box.mesh.shapes[run.cell], rest));
  count_particles(state, box.particles.size());
}
BENCHMARK(move<2>)->Arg(18)->Arg(112);
BENCHMARK(move<3>)->Arg(5)->Arg(24);

template <int D>
void strain(benchmark::State& state)
{
  Filled<D> box(static_cast<int>(state.range(0)));
  const CellStrain<D> none = strain_increment<D>(Matrix<D>{}, 1.0);
  for (auto _ : state)
    for (const Run& run : box.runs)
      strain_particles<D>(box.particles, run.first, run.last, none);
  count_particles(state, box.particles.size());
}
BENCHMARK(strain<2>)->Arg(18)->Arg(112);
BENCHMARK(strain<3>)->Arg(5)->Arg(24);

template <int D>
void stress_sums(benchmark::State& state)
{
  Filled<D> box(static_cast<int>(state.range(0)));
  for (auto _ : state)
    for (const Run& run : box.runs)
      benchmark::DoNotOptimize(stress_sum<Cartesian<D>>(box.particles, run.first, run.last));
  count_particles(state, box.particles.size());
}
BENCHMARK(stress_sums<2>)->Arg(18)->Arg(112);
BENCHMARK(stress_sums<3>)->Arg(5)->Arg(24);

/// What is done once per cell; rates are in cells.
template <int D>
struct Gathered : Filled<D>
{
  std::vector<CellMoments<Cartesian<D>>> moments;
  MeshPart part;
  NodeExchange exchange; // one rank: nothing is shared
  std::vector<NodeSums<D>> nodes;
  std::vector<Vector<D>> change, momentum;

  explicit Gathered(int n)
      : Filled<D>(n), moments(this->mesh.cells.size()), nodes(this->mesh.points.size()),
        change(this->mesh.points.size()), momentum(this->mesh.points.size())
  {
    std::vector<Index> cells;
    for (const Run& run : this->runs)
    {
      add_moments<Cartesian<D>>(this->particles, run.first, run.last, this->mesh.shapes[run.cell], moments[run.cell]);
      cells.push_back(run.cell);
    }
    part = make_part<D>(this->mesh, cells, {});
  }
};

template <int D>
void move_moments(benchmark::State& state)
{
  Gathered<D> box(static_cast<int>(state.range(0)));
  const CellMotion<D> rest{1, {}, {}};
  for (auto _ : state)
    for (CellMoments<Cartesian<D>>& moments : box.moments)
      move<Cartesian<D>>(moments, rest);
  count_particles(state, static_cast<Index>(box.moments.size()));
}
BENCHMARK(move_moments<2>)->Arg(18)->Arg(112);
BENCHMARK(move_moments<3>)->Arg(5)->Arg(24);

template <int D>
void scatter_to_nodes(benchmark::State& state)
{
  Gathered<D> box(static_cast<int>(state.range(0)));
  const auto stress_of = [&](Index c) { return box.moments[c].stress; };
  for (auto _ : state)
    scatter<Cartesian<D>>(box.mesh, box.exchange, box.part, box.moments, stress_of, {}, {}, box.nodes);
  count_particles(state, static_cast<Index>(box.moments.size()));
}
BENCHMARK(scatter_to_nodes<2>)->Arg(18)->Arg(112);
BENCHMARK(scatter_to_nodes<3>)->Arg(5)->Arg(24);

template <int D>
void scatter_changes(benchmark::State& state)
{
  Gathered<D> box(static_cast<int>(state.range(0)));
  for (auto _ : state)
    scatter_momentum<Cartesian<D>>(box.mesh, box.exchange, box.part, box.moments, box.change, box.momentum);
  count_particles(state, static_cast<Index>(box.moments.size()));
}
BENCHMARK(scatter_changes<2>)->Arg(18)->Arg(112);
BENCHMARK(scatter_changes<3>)->Arg(5)->Arg(24);

/// A law on one batch in the first-level cache. `shear` strains: 0 stays elastic, 1 yields everywhere.
template <int D>
void mohr_coulomb(benchmark::State& state)
{
  constexpr Index n = 256;
  const Law law = MohrCoulomb{200e3, 0.33, 1e3, 25.0};
  const bool yields = state.range(0) != 0, with_tangent = state.range(1) != 0;
  std::vector<Column> strain(n_stress<D>, Column(n, 0.0)), stress(n_stress<D>, Column(n, 0.0)), variables(1, Column(n));
  std::vector<double> tangent(static_cast<std::size_t>(n * n_stress<D> * n_stress<D>));
  double* columns[] = {variables[0].data()};
  PointBatch<D> points;
  points.size = n;
  for (int k = 0; k < n_stress<D>; ++k)
  {
    strain[k].assign(n, k == 3 && yields ? 1e-3 : 0.0);
    stress[k].assign(n, k < 3 ? -5e3 : 0.0);
    points.strain_increment[k] = strain[k].data();
    points.stress[k] = stress[k].data();
  }
  points.state = columns;
  points.tangent = with_tangent ? tangent.data() : nullptr;
  for (auto _ : state)
    benchmark::DoNotOptimize(update<D>(law, points));
  count_particles(state, n);
}
BENCHMARK(mohr_coulomb<2>)->ArgNames({"yields", "tangent"})->ArgsProduct({{0, 1}, {0, 1}});
BENCHMARK(mohr_coulomb<3>)->ArgNames({"yields", "tangent"})->ArgsProduct({{0, 1}, {0, 1}});
} // namespace

BENCHMARK_MAIN();
