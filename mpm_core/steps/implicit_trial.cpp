#include "steps/implicit_trial.h"

#include "steps/batches.h"
#include "transfer/kinematics.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// Part of a cell's volume below which an increment is refused.
constexpr double least_growth = 0.1;

/// Copies of a batch: what a law reads and writes.
template <int D>
struct TrialScratch
{
  alignas(64) double strain[n_stress<D>][batch_size];
  alignas(64) double stress[n_stress<D>][batch_size]; ///< at the start, turned with the material; then at the end
  alignas(64) double state[max_states][batch_size];
  std::vector<double> tangent;
};

/// What turns with the iterate in one cell: strain and rotation, and the derivatives of the rotation.
template <int D>
struct CellTurn
{
  CellStrain<D> strain;
  /// For each pair b < m of axes, d Omega = dR R^T per du_b/dx_m; its negative belongs to du_m/dx_b
  std::array<Matrix<D>, D*(D - 1) / 2> spin;
};

template <int D>
constexpr std::array<std::array<int, 2>, D*(D - 1) / 2> spin_pairs = []
{
  std::array<std::array<int, 2>, D*(D - 1) / 2> pairs{};
  for (int b = 0, k = 0; b < D; ++b)
    for (int m = b + 1; m < D; ++m)
      pairs[k++] = {b, m};
  return pairs;
}();

/// The Cayley transform R of the half spin W has dR R^T = 2 Y dW Y^T with Y = (1 - W)^-1 = (1 + R) / 2.
template <int D>
CellTurn<D> cell_turn(const CellStrain<D>& strain)
{
  CellTurn<D> turn{strain, {}};
  Matrix<D> y = strain.rotation;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      y[i][j] = 0.5 * (y[i][j] + (i == j ? 1.0 : 0.0));
  for (std::size_t k = 0; k < turn.spin.size(); ++k)
  {
    const auto [b, m] = spin_pairs<D>[k];
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        turn.spin[k][i][j] = 0.5 * (y[i][b] * y[j][m] - y[i][m] * y[j][b]);
  }
  return turn;
}

/// Omega sigma - sigma Omega of a symmetric tensor; zz of plane strain does not turn.
template <int D>
SymTensor<D> turned_by(const Matrix<D>& omega, const SymTensor<D>& stress)
{
  Matrix<D> product{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k)
        product[i][j] += omega[i][k] * stress[stress_component<D>[symmetric_index<D>(k, j)]];
  SymTensor<D> turned{};
  for (int k = 0; k < n_symmetric<D>; ++k)
  {
    const auto [i, j] = symmetric_pairs<D>[k];
    turned[stress_component<D>[k]] = product[i][j] + product[j][i]; // -sigma Omega is the transpose of Omega sigma
  }
  return turned;
}

/// The same of a strain with engineering shear.
template <int D>
SymTensor<D> turned_strain(const Matrix<D>& omega, SymTensor<D> strain)
{
  for (int k = 3; k < n_stress<D>; ++k)
    strain[k] /= 2;
  SymTensor<D> turned = turned_by<D>(omega, strain);
  for (int k = 3; k < n_stress<D>; ++k)
    turned[k] *= 2;
  return turned;
}

/// Adds V d sigma / d grad u of one particle: the law's tangent C acts on the strain. To the rotation goes what follows
/// from isotropy: had the strain turned along with the start's stress, the result would have, too; so it changes by
/// (Omega sigma - sigma Omega) - C (Omega de - de Omega).
template <int D>
void add_tangent(const double* c, const CellTurn<D>& turn, const SymTensor<D>& stress, double volume, bool averaged,
                 CellTangent<D>& tangent)
{
  constexpr int S = n_stress<D>;
  for (int b = 0; b < D; ++b)
    for (int m = 0; m < D; ++m)
      for (int k = 0; k < n_symmetric<D>; ++k)
        tangent.by_gradient[k][b * D + m] += volume * c[stress_component<D>[k] * S + stress_component<D>[symmetric_index<D>(b, m)]];
  for (std::size_t s = 0; s < turn.spin.size(); ++s)
  {
    const SymTensor<D> with_stress = turned_by<D>(turn.spin[s], stress);
    const SymTensor<D> with_strain = turned_strain<D>(turn.spin[s], turn.strain.increment);
    const auto [b, m] = spin_pairs<D>[s];
    for (int k = 0; k < n_symmetric<D>; ++k)
    {
      double turned = with_stress[stress_component<D>[k]];
      for (int j = 0; j < S; ++j)
        turned -= c[stress_component<D>[k] * S + j] * with_strain[j];
      tangent.by_gradient[k][b * D + m] += volume * turned;
      tangent.by_gradient[k][m * D + b] -= volume * turned;
    }
  }
  if (averaged)
    for (int k = 0; k < n_symmetric<D>; ++k)
    {
      double volumetric = 0;
      for (int j = 0; j < D; ++j)
        volumetric += c[stress_component<D>[k] * S + j] / D;
      tangent.by_volumetric[k] += volume * volumetric;
      for (int j = 0; j < D; ++j)
        tangent.by_gradient[k][j * D + j] -= volume * volumetric;
    }
}

/// Volume of a cell after a displacement, relative to that before: det(1 + grad u).
template <int D>
double growth(const Matrix<D>& velocity_gradient, double dt)
{
  Matrix<D> f;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      f[i][j] = dt * velocity_gradient[i][j] + (i == j ? 1.0 : 0.0);
  if constexpr (D == 2)
    return f[0][0] * f[1][1] - f[0][1] * f[1][0];
  else
    return f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0]) +
           f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0]);
}

/// Strain and rotation of a cell.
template <int D>
CellStrain<D> cell_strain(const Model<D>& model, const ImplicitStep<D>& step, Index cell, TrialCount& count)
{
  const auto velocity = [&](Index i) -> const Vector<D>& { return model.work.velocity[i]; };
  const Matrix<D> gradient = affine_field<D>(model.mesh, cell, velocity).gradient;
  CellStrain<D> strain = strain_increment<D>(gradient, step.dt);
  if (step.options.mixed_discretisation)
    set_volumetric(strain, model.work.volumetric_strain[cell]);
  if (!(growth<D>(gradient, step.dt) > least_growth && 1 + strain.volumetric > least_growth))
    ++count.failed;
  return strain;
}

/// Copies one run's stresses, turned, and its states to the scratch and prepares its strains.
template <int D>
void load_run(const Model<D>& model, const Run& run, const CellStrain<D>& strain, Index at, TrialScratch<D>& scratch)
{
  const Index size = run.last - run.first;
  for (int k = 0; k < n_stress<D>; ++k)
  {
    std::fill_n(scratch.strain[k] + at, size, strain.increment[k]);
    std::copy_n(model.particles.stress[k].data() + run.first, size, scratch.stress[k] + at);
  }
  SymmetricColumns<D> columns;
  for (int k = 0; k < n_symmetric<D>; ++k)
    columns[k] = scratch.stress[stress_component<D>[k]];
  rotate<D>(columns, at, at + size, strain.rotation);
  for (std::size_t k = 0; k < model.particles.state.size(); ++k)
    std::copy_n(model.particles.state[k].data() + run.first, size, scratch.state[k] + at);
}

template <int D>
BatchReport update_scratch(const Law& law, Index size, bool tangents, TrialScratch<D>& scratch)
{
  PointBatch<D> points;
  points.size = size;
  for (int k = 0; k < n_stress<D>; ++k)
  {
    points.strain_increment[k] = scratch.strain[k];
    points.stress[k] = scratch.stress[k];
  }
  std::array<double*, max_states> state;
  for (int k = 0; k < max_states; ++k)
    state[k] = scratch.state[k];
  points.state = state.data();
  points.tangent = tangents ? scratch.tangent.data() : nullptr;
  return update<D>(law, points);
}

/// Adds the particles of one run, at `at` in the scratch, to the sums of its cell.
template <int D>
void sum_run(const Model<D>& model, ImplicitStep<D>& step, const Run& run, Index at, const TrialScratch<D>& scratch)
{
  const double* const volume = model.particles.volume.data() + run.first;
  for (int k = 0; k < n_symmetric<D>; ++k)
    for (Index p = 0; p < run.last - run.first; ++p)
      step.stress[run.cell][k] += volume[p] * scratch.stress[stress_component<D>[k]][at + p];
}

template <int D>
void sum_tangents(const Model<D>& model, ImplicitStep<D>& step, const Run& run, const CellStrain<D>& strain, Index at,
                  const TrialScratch<D>& scratch)
{
  const CellTurn<D> turn = cell_turn<D>(strain);
  for (Index p = 0; p < run.last - run.first; ++p)
  {
    SymTensor<D> stress;
    for (int k = 0; k < n_stress<D>; ++k)
      stress[k] = scratch.stress[k][at + p];
    add_tangent<D>(&scratch.tangent[static_cast<std::size_t>((at + p) * n_stress<D> * n_stress<D>)], turn, stress,
                   model.particles.volume[run.first + p], step.options.mixed_discretisation, step.tangents[run.cell]);
  }
}
} // namespace

template <int D>
TrialCount try_stresses(const Model<D>& model, ImplicitStep<D>& step, bool tangents)
{
  const auto cells = static_cast<std::size_t>(model.mesh.owned_cells);
  step.stress.assign(cells, {});
  if (tangents)
    step.tangents.assign(cells, {});
  TrialScratch<D> scratch;
  if (tangents)
    scratch.tangent.resize(static_cast<std::size_t>(batch_size * n_stress<D> * n_stress<D>));
  std::vector<CellStrain<D>> strains;
  TrialCount count;
  const auto& runs = model.work.runs;
  for (std::size_t r = 0; r < runs.size();)
  {
    const Batch batch = next_batch(runs, r);
    strains.clear();
    for (r = batch.first_run; r < batch.last_run; ++r)
    {
      strains.push_back(cell_strain(model, step, runs[r].cell, count));
      load_run(model, runs[r], strains.back(), runs[r].first - batch.first, scratch);
    }
    const BatchReport report = update_scratch<D>(model.laws[batch.material], batch.last - batch.first, tangents, scratch);
    count.plastic += report.plastic;
    count.failed += report.failed;
    for (std::size_t k = 0; k < strains.size(); ++k)
    {
      const Run& run = runs[batch.first_run + k];
      sum_run(model, step, run, run.first - batch.first, scratch);
      if (tangents)
        sum_tangents(model, step, run, strains[k], run.first - batch.first, scratch);
    }
  }
  return count;
}

template TrialCount try_stresses(const Model<2>&, ImplicitStep<2>&, bool);
template TrialCount try_stresses(const Model<3>&, ImplicitStep<3>&, bool);
} // namespace mpm
