#include "implicit/trial.h"

#include "base/eigen.h"
#include "implicit/cell_tangent.h"
#include "model/integration.h"
#include "model/law_increment.h"
#include "model/mapping.h"
#include "particles/batches.h"
#include "transfer/affine_field.h"
#include "transfer/kinematics.h"

#include <algorithm>

namespace mpm::implicit
{
namespace
{
/// Part of a cell's volume below which an increment is refused.
constexpr double least_growth = 0.1;

/// Strain and rotation of a cell.
template <int D>
struct TrialStrain
{
  Matrix<D> gradient; ///< of the displacement
  CellStrain<D> strain;
  bool keeps_volume;
};

/// Copies of a batch: what a law reads and writes.
template <int D>
struct TrialScratch
{
  alignas(64) double strain[n_stress<D>][batch_size];
  alignas(64) double stress[n_stress<D>][batch_size]; ///< at the start, turned with the material; then at the end
  alignas(64) double state[max_states][batch_size];
  std::vector<double> tangent;                   ///< (batch_size, components, components)
  std::array<TrialStrain<D>, batch_size> trials; ///< of the runs
  LawIncrement<D> increment;
};

/// Volume of a cell after a displacement, relative to that before: det(1 + grad u).
template <int D>
double growth(const Matrix<D>& velocity_gradient, double dt)
{
  Matrix<D> f;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      f[i][j] = dt * velocity_gradient[i][j] + (i == j ? 1.0 : 0.0);
  return as_eigen<D>(f).determinant();
}

template <class G, int D = G::dim>
TrialStrain<D> cell_strain(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step, Index cell)
{
  const auto velocity = [&](Index i) -> const Vector<D>& { return field.velocity[i]; };
  const AffineField<D> in_cell = affine_field<D>(mesh, cell, velocity);
  const Matrix<D>& gradient = in_cell.gradient;
  CellStrain<D> strain = strain_increment<D>(gradient, step.dt);
  double hoop = 0;
  if constexpr (G::has_hoop)
  {
    hoop = step.dt * in_cell.value[0] / mesh.shapes[cell].centre[0];
    add_hoop(strain, hoop);
  }
  if (step.options.nmd)
    set_volumetric<G>(strain, averaged_strain<G>(mesh, field, cell, strain.volumetric));
  if (step.options.hold_positions)
  {
    make_small<D>(strain);
    return {{}, strain, true};
  }
  Matrix<D> displacement_gradient = gradient;
  for (Vector<D>& row : displacement_gradient)
    for (double& entry : row)
      entry *= step.dt;
  const double least = step.pore.cells.empty() ? least_growth : std::max(least_growth, step.pore.cells[cell].grains);
  return {displacement_gradient, strain,
          (1 + hoop) * growth<D>(gradient, step.dt) > least_growth && 1 + strain.volumetric > least};
}

/// Copies a batch's stresses and states to the scratch.
template <int D>
void load_batch(const Particles<D>& particles, const Batch& batch, TrialScratch<D>& scratch)
{
  const Index size = batch.last - batch.first;
  for (int k = 0; k < n_stress<D>; ++k)
    std::copy_n(particles.stress[k].data() + batch.first, size, scratch.stress[k]);
  for (std::size_t k = 0; k < particles.state.size(); ++k)
    std::copy_n(particles.state[k].data() + batch.first, size, scratch.state[k]);
}

/// Strains one run and turns its stresses, at `at` in the scratch.
template <int D>
void strain_run(Index size, const CellStrain<D>& strain, Index at, TrialScratch<D>& scratch)
{
  for (int k = 0; k < n_stress<D>; ++k)
    std::fill_n(scratch.strain[k] + at, size, strain.increment[k]);
  SymmetricColumns<D> columns;
  for (int k = 0; k < n_symmetric<D>; ++k)
    columns[k] = scratch.stress[stress_component<D>[k]];
  rotate<D>(columns, at, at + size, strain.rotation);
}

/// Counts a failure, and keeps the failure of the first.
template <int D>
void note_failure(const Particles<D>& particles, typename Failure<D>::Kind kind, Index particle,
                  const SymTensor<D>& increment, TrialCount<D>& count)
{
  if (count.failed++ == 0)
    count.failure = failure_of<D>(particles, kind, particle, increment);
}

template <int D>
void note_failed_laws(const Particles<D>& particles, const Batch& batch, const std::vector<Index>& failed,
                      const TrialScratch<D>& scratch, TrialCount<D>& count)
{
  for (Index i : failed)
  {
    SymTensor<D> increment;
    for (int k = 0; k < n_stress<D>; ++k)
      increment[k] = scratch.strain[k][i];
    note_failure<D>(particles, Failure<D>::Kind::law_failed, batch.first + i, increment, count);
  }
}

template <class G, int D = G::dim>
BatchReport update_scratch(const Mesh<D>& mesh, const MaterialPoints<D>& material, const ImplicitStep<G>& step,
                           const Batch& batch, TrialScratch<D>& scratch)
{
  PointBatch<D> points;
  points.size = batch.last - batch.first;
  for (int k = 0; k < n_stress<D>; ++k)
  {
    points.strain_increment[k] = scratch.strain[k];
    points.stress[k] = scratch.stress[k];
  }
  std::array<double*, max_states> state;
  for (int k = 0; k < max_states; ++k)
    state[k] = scratch.state[k];
  points.state = state.data();
  points.tangent = scratch.tangent.empty() ? nullptr : scratch.tangent.data();
  points.time = step.time;
  points.dt = law_dt(step);
  give_cell_sizes(mesh, material, batch, scratch.increment, points);
  if (!step.options.hold_positions)
    give_deformation(
        material, batch, [&](std::size_t r) { return scratch.trials[r].gradient; },
        [&](std::size_t r) { return scratch.trials[r].strain.volumetric; }, scratch.increment, points);
  return update<D>(material.laws[batch.material], points);
}

/// Adds the V sigma of one run, at `at` in the scratch.
template <class G, int D = G::dim>
void sum_stress(const Column& volumes, const Run& run, Index at, const TrialScratch<D>& scratch, Working<G>& stress)
{
  const double* const volume = volumes.data() + run.first;
  auto sum = stress;
  for (Index p = 0; p < run.last - run.first; ++p)
    for (int k = 0; k < G::n_working; ++k) // sums side by side, none waits for the other
      sum[k] += volume[p] * scratch.stress[working_component<G>[k]][at + p];
  stress = sum;
}

/// Adds V C of one run, of the components that do work.
template <class G, int D = G::dim>
void sum_stiffness(const Column& volumes, const Run& run, Index at, const TrialScratch<D>& scratch,
                   std::array<Working<G>, G::n_working>& stiffness)
{
  constexpr int S = n_stress<D>;
  auto sum = stiffness; // not through the reference, which might be to what is read
  for (Index p = 0; p < run.last - run.first; ++p)
  {
    const double* const c = &scratch.tangent[static_cast<std::size_t>((at + p) * S * S)];
    const double volume = volumes[run.first + p];
    for (int k = 0; k < G::n_working; ++k)
      for (int j = 0; j < G::n_working; ++j)
        sum[k][j] += volume * c[working_component<G>[k] * S + working_component<G>[j]];
  }
  stiffness = sum;
}

/// Full cells integrate the mean of their particles over their own volume.
template <class G, int D = G::dim>
void integrate_cells(const Mesh<D>& mesh, const VelocityField<G>& field, ImplicitStep<G>& step)
{
  for (Index c : step.cells)
  {
    const double factor = integration_factor(mesh, field, c);
    for (double& component : step.stress[c])
      component *= factor;
    if (!step.stiffness.empty())
      for (auto& row : step.stiffness[c])
        for (double& component : row)
          component *= factor;
  }
}

/// Strains, stresses and sums of one batch; the strains of its cells stay in the step.
template <class G, int D = G::dim>
void try_batch(const Mesh<D>& mesh, const MaterialPoints<D>& material, const VelocityField<G>& field,
               const Batch& batch, TrialScratch<D>& scratch, ImplicitStep<G>& step, TrialCount<D>& count)
{
  const auto& [particles, runs, laws] = material;
  load_batch(particles, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const TrialStrain<D>& trial = scratch.trials[r - batch.first_run] = cell_strain(mesh, field, step, runs[r].cell);
    step.strains[runs[r].cell] = trial.strain;
    strain_run<D>(runs[r].last - runs[r].first, trial.strain, runs[r].first - batch.first, scratch);
    if (!trial.keeps_volume)
      note_failure<D>(particles, Failure<D>::Kind::lost_volume, runs[r].first, trial.strain.increment, count);
  }
  const BatchReport report = update_scratch(mesh, material, step, batch, scratch);
  count.plastic += report.plastic;
  note_failed_laws(particles, batch, report.failed, scratch, count);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Index at = runs[r].first - batch.first;
    sum_stress<G>(particles.volume, runs[r], at, scratch, step.stress[runs[r].cell]);
    if (!step.stiffness.empty())
      sum_stiffness<G>(particles.volume, runs[r], at, scratch, step.stiffness[runs[r].cell]);
  }
}
} // namespace

template <class G, int D>
TrialCount<D> try_stresses(const Mesh<D>& mesh, const MaterialPoints<D>& material, const VelocityField<G>& field,
                           bool tangents, ImplicitStep<G>& step)
{
  const auto cells = static_cast<std::size_t>(mesh.owned_cells);
  step.stress.assign(cells, {});
  step.stiffness.assign(tangents ? cells : 0, {});
  step.strains.resize(cells);
  TrialScratch<D> scratch;
  scratch.tangent.resize(tangents ? static_cast<std::size_t>(batch_size * n_stress<D> * n_stress<D>) : 0);
  TrialCount<D> count;
  for (std::size_t r = 0; r < material.runs.size();)
  {
    const Batch batch = next_batch(material.runs, r);
    try_batch(mesh, material, field, batch, scratch, step, count);
    r = batch.last_run;
  }
  if (step.options.integration == Integration::mixed)
    integrate_cells(mesh, field, step);
  if (!tangents)
    return count;
  step.tangents.resize(cells);
  for (Index c : step.cells)
    step.tangents[c] =
        cell_tangent<G>(step.stiffness[c], step.stress[c], step.strains[c], step.options,
                        averaged_strain_fraction(field.integration, c), averaged_fraction(field.integration, c));
  return count;
}

#define INSTANTIATE(G)                                                                                                 \
  template TrialCount<G::dim> try_stresses(const Mesh<G::dim>&, const MaterialPoints<G::dim>&,                         \
                                           const VelocityField<G>&, bool, ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
