#include "model/resting_pass.h"

#include "model/law_update.h"
#include "model/mapping.h"
#include "model/resting_nodes.h"
#include "transfer/affine_field.h"
#include "transfer/kinematics.h"
#include "transfer/resting.h"
#include "transfer/turn.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace mpm::model
{
namespace
{
/// Scratch of a batch, in the first-level cache.
template <int D>
struct RestingScratch
{
  // Per cell, one column per component
  alignas(64) double gradient[D * D][batch_size + lanes]; ///< of displacement
  alignas(64) double volumetric[batch_size + lanes];
  alignas(64) double strain[n_stress<D>][batch_size + lanes];

  RestingScratch()
  {
    for (auto& component : strain) // that out of plane stays zero
      std::ranges::fill(component, 0.0);
  }
};

/// Gradient of the displacement over dt of `lanes` cells.
template <class G, int D = G::dim>
[[gnu::always_inline]] inline std::array<std::array<Lanes, D>, D> displacement_gradient(const VelocityField<G>& field,
                                                                                        double dt, std::size_t first)
{
  const auto* v = &field.resting.vertices[first];
  const auto at = [&](int k) { return by_component<D>([&](int l) -> const auto& { return field.velocity[v[l][k]]; }); };
  const std::array<Lanes, D> u = at(0);
  std::array<std::array<Lanes, D>, D> gradient{};
  for (int k = 0; k < D; ++k)
  {
    const std::array<Lanes, D> end = at(k + 1);
    for (int a = 0; a < D; ++a)
    {
      const Lanes relative = dt * (end[a] - u[a]);
      for (int b = 0; b < D; ++b)
        gradient[a][b] += relative * load(&field.resting.gradient[k * D + b][first]);
    }
  }
  return gradient;
}

/// Hoop strain over dt of `lanes` cells.
template <class G, int D = G::dim>
Lanes hoop_strain(const VelocityField<G>& field, double dt, std::size_t first)
{
  Lanes sum{};
  for (std::size_t l = 0; l < lanes; ++l)
    for (Index node : field.resting.vertices[first + l])
      sum[l] += field.velocity[node][0];
  return dt * sum * load(&field.resting.hoop[first]);
}

/// Columns that a strain changes, and the hoop stress in axial symmetry, which it does not rotate.
template <class G, int D = G::dim>
auto columns_to_strain(Particles<D>& particles)
{
  constexpr int n = n_symmetric<D> + 2;
  std::array<double*, n + (G::has_hoop ? 1 : 0)> columns;
  std::ranges::copy(strain_columns(particles), columns.begin());
  if constexpr (G::has_hoop)
    columns[n] = particles.stress[working_component<G>[n_symmetric<D>]].data();
  return columns;
}

/// The stresses among them that do work.
template <class G, std::size_t N>
std::array<Lanes, G::n_working> working_stress(const Piece<N>& piece)
{
  std::array<Lanes, G::n_working> stress;
  std::copy_n(piece.begin(), n_symmetric<G::dim>, stress.begin());
  if constexpr (G::has_hoop)
    stress.back() = piece.back();
  return stress;
}

/// Calls `change(piece, i, count)` on rows first + i of columns and those behind, `count` of `lanes`, and writes them
/// back, unless they are constant. Columns are named one by one, and the last few rows are apart: g++ keeps a piece in
/// registers then.
template <std::size_t N, class T, class Change>
[[gnu::always_inline]] inline void for_rows(const std::array<T*, N>& columns, const Batch& batch, Change&& change)
{
  const Index size = batch.last - batch.first, whole = size - size % lanes;
  const auto change_whole = [&]<std::size_t... k>(std::index_sequence<k...>, Index i) __attribute__((always_inline))
  {
    Piece<N> piece{load(columns[k] + batch.first + i)...};
    change(piece, static_cast<std::size_t>(i), lanes);
    if constexpr (!std::is_const_v<T>)
      (store(piece[k], columns[k] + batch.first + i), ...);
  };
  for (Index i = 0; i < whole; i += lanes)
    change_whole(std::make_index_sequence<N>{}, i);
  if (whole == size)
    return;
  Piece<N> piece = load_few(columns, batch.first + whole, batch.last);
  change(piece, static_cast<std::size_t>(whole), size - whole);
  if constexpr (!std::is_const_v<T>)
    for (std::size_t k = 0; k < N; ++k)
      for (int l = 0; l < size - whole; ++l)
        columns[k][batch.first + whole + l] = piece[k][l];
}

/// Volumetric strains by nodal mixed discretisation of cells side by side.
template <class G, int D = G::dim>
Lanes averaged_strains(const Mesh<D>& mesh, const VelocityField<G>& field, std::size_t first, const Lanes& own)
{
  Lanes averaged = own;
  for (std::size_t l = 0; l < lanes && first + l < field.resting.runs.size(); ++l)
    averaged[l] = averaged_strain<G>(mesh, field, field.resting.runs[first + l].cell, own[l]);
  return averaged;
}

/// Work of stress times volume on the strain of cells side by side, without those beyond the last.
template <class G>
Lanes work(const std::array<Lanes, G::n_working>& stress, const Lanes& volume,
           const std::array<Lanes, G::n_working>& strain, Index cells)
{
  Lanes sum{};
  for (int k = 0; k < G::n_working; ++k)
    sum += stress[k] * strain[k];
  constexpr LaneMask number{0, 1, 2, 3};
  return number < static_cast<std::int64_t>(cells) ? sum * volume : Lanes{};
}

/// Strains the cells of a batch: rotates their stresses, grows their volumes, accumulates deviatoric strains, and
/// leaves the increments in the scratch.
/// @param growth  set to a sum over volumetric strains, finite where all are
/// @returns work of the stresses before on the strains
template <class G, int D = G::dim>
double strain_batch(const Mesh<D>& mesh, const VelocityField<G>& field, const PassOptions& options, const Batch& batch,
                    Particles<D>& particles, RestingScratch<D>& scratch, double& growth)
{
  constexpr int S = n_symmetric<D>;
  Lanes work_before{}, all_growth{};
  const auto strain_piece = [&](auto& piece, std::size_t i, Index cells) __attribute__((always_inline))
  {
    const auto gradient = displacement_gradient(field, options.dt, batch.first_run + i);
    CellStrain<D, Lanes> strain = strain_increment<D>(gradient, 1);
    if constexpr (G::has_hoop)
      add_hoop(strain, hoop_strain(field, options.dt, batch.first_run + i));
    if (options.nmd)
      set_volumetric<G>(strain, averaged_strains(mesh, field, batch.first_run + i, strain.volumetric));
    if (options.small)
      make_small<D>(strain);
    std::array<Lanes, G::n_working> increment;
    for (int k = 0; k < G::n_working; ++k)
    {
      increment[k] = strain.increment[working_component<G>[k]];
      store(increment[k], scratch.strain[working_component<G>[k]] + i);
    }
    store(strain.volumetric, scratch.volumetric + i);
    all_growth += strain.volumetric;
    for (int k = 0; k < D * D; ++k)
      store(gradient[k / D][k % D], scratch.gradient[k] + i);
    work_before += work<G>(working_stress<G>(piece), piece[S], increment, cells);
    turn<D>(piece, strain.rotation);
    piece[S] *= 1 + strain.volumetric;
    piece[S + 1] += strain.deviatoric;
  };
  for_rows(columns_to_strain<G>(particles), batch, strain_piece);
  growth = sum(all_growth);
  return sum(work_before);
}

/// Adds the forces of the stresses of `n` cells, at most `lanes`, to their nodes.
template <class G, int D = G::dim>
[[gnu::always_inline]] inline void add_forces(const std::array<Lanes, G::n_working>& stress, std::size_t first,
                                              std::size_t n, RestingCells<D>& resting)
{
  std::array<std::array<Lanes, D>, D + 1> force{};
  for (int k = 0; k < D; ++k)
    for (int b = 0; b < D; ++b)
    {
      const Lanes gradient = load(&resting.gradient[k * D + b][first]);
      for (int a = 0; a < D; ++a)
        force[k + 1][a] += stress[symmetric_index<D>(a, b)] * gradient;
    }
  for (int k = 1; k <= D; ++k)
    for (int a = 0; a < D; ++a)
      force[0][a] -= force[k][a];
  if constexpr (G::has_hoop)
    for (int k = 0; k <= D; ++k)
      force[k][0] += stress.back() * load(&resting.hoop[first]);
  for (std::size_t l = 0; l < n; ++l)
    for (int k = 0; k <= D; ++k)
    {
      Vector<D>& internal = resting.sums[resting.vertices[first + l][k]].internal;
      for (int a = 0; a < D; ++a)
        internal[a] += force[k][a][l];
    }
}

/// Sums the forces of the stresses of a batch at the nodes.
/// @returns work of the stresses on the strains
template <class G, int D = G::dim>
double integrate_batch(const Particles<D>& particles, const Batch& batch, const RestingScratch<D>& scratch,
                       RestingCells<D>& resting)
{
  constexpr int S = G::n_working;
  std::array<const double*, S + 1> columns;
  for (int k = 0; k < S; ++k)
    columns[k] = particles.stress[working_component<G>[k]].data();
  columns[S] = particles.volume.data();
  Lanes work_after{};
  const auto integrate_piece = [&](const auto& piece, std::size_t i, Index cells) __attribute__((always_inline))
  {
    std::array<Lanes, S> increment, stress, force;
    for (int k = 0; k < S; ++k)
    {
      increment[k] = load(scratch.strain[working_component<G>[k]] + i);
      stress[k] = piece[k];
      force[k] = piece[k] * piece[S];
    }
    work_after += work<G>(stress, piece[S], increment, cells);
    add_forces<G>(force, batch.first_run + i, static_cast<std::size_t>(cells), resting);
  };
  for_rows(columns, batch, integrate_piece);
  return sum(work_after);
}

/// Strains and stresses of a batch, their work, and the forces of the stresses.
template <class G, int D = G::dim>
void pass_batch(Model<G>& model, const PassOptions& options, const Batch& batch, RestingScratch<D>& scratch)
{
  VelocityField<G>& field = model.fields.front();
  double growth = 0;
  model.energy.stress_work += 0.5 * strain_batch(model.mesh, field, options, batch, model.particles, scratch, growth);
  if (!std::isfinite(growth))
    note_failure<D>(model.failure, model.particles, Failure<D>::Kind::not_finite, batch.first, {});
  const auto deform = [&](const MaterialPoints<D>& material, LawIncrement<D>& columns, PointBatch<D>& points)
  {
    const auto gradient = [&](std::size_t r)
    {
      Matrix<D> f;
      for (int k = 0; k < D * D; ++k)
        f[k / D][k % D] = scratch.gradient[k][r];
      return f;
    };
    give_deformation(
        material, batch, gradient, [&](std::size_t r) { return scratch.volumetric[r]; }, columns, points);
  };
  update_law<G>(model, resting_points(model), options, batch, scratch.strain, deform);
  model.energy.ahead += 0.5 * integrate_batch<G>(model.particles, batch, scratch, field.resting);
}

/// Stresses and volumes in the moments of resting cells, for what is averaged or integrated over whole cells, and where
/// rows do not move.
template <class G, int D = G::dim>
void update_moments(const Particles<D>& particles, VelocityField<G>& field)
{
  for (const Run& run : field.resting.runs)
  {
    CellMoments<G>& moments = field.moments[run.cell];
    moments.volume = particles.volume[run.first];
    for (int k = 0; k < G::n_working; ++k)
      moments.stress[k] = moments.volume * particles.stress[working_component<G>[k]][run.first];
  }
}
} // namespace

template <class G>
void resting_pass(Model<G>& model, const PassOptions& options)
{
  VelocityField<G>& field = model.fields.front();
  RestingCells<G::dim>& resting = field.resting;
  if (resting.runs.empty())
    return;
  if (options.move || options.count_displacement)
    move_resting_nodes(model, options);
  if (!options.stress)
    return;
  for (Index i : resting.nodes)
    resting.sums[i].internal = {};
  RestingScratch<G::dim> scratch;
  for (const Batch& batch : resting.batches)
    pass_batch(model, options, batch, scratch);
  if (options.nmd || options.small || field.integration.kind != Integration::particles)
    update_moments(model.particles, field);
}

#define INSTANTIATE(G) template void resting_pass(Model<G>&, const PassOptions&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
