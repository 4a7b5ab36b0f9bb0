#include "model/batch_strain.h"

#include "model/integration.h"
#include "transfer/affine_field.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// Runs after which the data of a cell are wanted: they are asked for so much ahead. A processor does not foresee them,
/// as a cell's few hundred bytes are followed by those of particles.
constexpr std::size_t ahead = 12;

template <class T>
inline void prefetch(const T& object)
{
  const char* const bytes = reinterpret_cast<const char*>(&object);
  for (std::size_t at = 0; at < sizeof(T); at += 64)
    __builtin_prefetch(bytes + at);
}
} // namespace

template <int D>
void find_motions(const Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  const Workspace<D>& work = model.work;
  const auto change = [&](Index i) -> const Vector<D>& { return work.velocity_change[i]; };
  const auto velocity = [&](Index i) -> const Vector<D>& { return work.velocity[i]; };
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Index cell = work.runs[r].cell;
    if (r + ahead < work.runs.size())
    {
      const Index next = work.runs[r + ahead].cell;
      prefetch(model.mesh.shapes[next]);
      prefetch(work.moments[next]);
    }
    const AffineField<D> fields[]{affine_field<D>(model.mesh, cell, change),
                                  affine_field<D>(model.mesh, cell, velocity)};
    scratch.motion[r - batch.first_run] = {1 - options.pic_share, fields[0], scaled<D>(fields[1], options.dt)};
  }
}

namespace
{
/// Strains of the cells of a batch, from the displacements. Beyond the last run the lanes hold what was there before.
template <int D>
void find_cell_strains(const Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  const std::size_t n = batch.last_run - batch.first_run;
  for (std::size_t first = 0; first < n; first += lanes)
  {
    static_assert(lanes == 4);
    const CellMotion<D>* const motion = &scratch.motion[first];
    std::array<std::array<Lanes, D>, D> gradient;
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b) // in registers: a vector read where single numbers were just written has to wait
        gradient[a][b] = Lanes{motion[0].displacement.gradient[a][b], motion[1].displacement.gradient[a][b],
                               motion[2].displacement.gradient[a][b], motion[3].displacement.gradient[a][b]};
    CellStrain<D, Lanes>& strain = scratch.cells[first / lanes];
    strain = strain_increment<D>(gradient, 1);
    if (options.averaged)
    {
      Lanes theta{};
      for (std::size_t r = first; r < std::min(n, first + lanes); ++r)
        theta[r - first] = mean_volumetric_strain<D>(model.mesh.cells[model.work.runs[batch.first_run + r].cell],
                                                     model.work.volumetric_strain);
      set_volumetric<D>(strain, theta);
    }
    if (options.small)
      make_small<D>(strain);
  }
}

/// Strains the particles of a batch, those of a cell alike.
template <int D>
void strain_cells(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  find_cell_strains(model, options, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = model.work.runs[r];
    const CellStrain<D> strain = scratch.cell_strain(r - batch.first_run);
    for (Index i = run.first - batch.first; i < run.last - batch.first;
         i += lanes) // the next run overwrites the excess
      for (int k : stress_component<D>)
        std::fill_n(scratch.strain[k] + i, lanes, strain.increment[k]);
    strain_particles<D>(model.particles, run.first, run.last, strain);
  }
}

/// Strains the particles of a batch, each by the gradient at its own place.
template <int D>
void strain_dual_domains(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = model.work.runs[r];
    for (Index p = run.first; p < run.last; ++p)
    {
      CellStrain<D> strain = strain_increment<D>(dual_gradient(model, p, run.cell), options.dt);
      if (options.averaged)
        set_volumetric<D>(strain, mean_volumetric_strain<D>(model.mesh.cells[run.cell], model.work.volumetric_strain));
      for (int k = 0; k < n_stress<D>; ++k)
        scratch.strain[k][p - batch.first] = strain.increment[k];
      strain_particles<D>(model.particles, p, p + 1, strain);
    }
  }
}
} // namespace

template <int D>
void strain_batch(Model<D>& model, const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  if (model.integration == Integration::dual_domain)
    strain_dual_domains(model, options, batch, scratch);
  else
    strain_cells(model, options, batch, scratch);
}

#define INSTANTIATE(D)                                                                                                 \
  template void find_motions(const Model<D>&, const PassOptions&, const Batch&, BatchScratch<D>&);                     \
  template void strain_batch(Model<D>&, const PassOptions&, const Batch&, BatchScratch<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
