#include "model/batch_strain.h"

#include "model/integration.h"
#include "model/law_increment.h"
#include "model/mapping.h"
#include "transfer/affine_field.h"

#include <algorithm>

namespace mpm::model
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

/// The motions of the runs of a batch.
/// @param value_of  of vertex k of a cell; a callable (nodal, Index, int) -> Vector<D>
template <class G, class ValueOf, int D = G::dim>
void find_motions(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                  const PassOptions& options, const Batch& batch, ValueOf&& value_of, BatchScratch<D>& scratch)
{
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Index cell = runs[r].cell;
    if (r + ahead < runs.size())
    {
      const Index next = runs[r + ahead].cell;
      prefetch(mesh.shapes[next]);
      prefetch(field.moments[next]);
    }
    const auto in_cell = [&](const std::vector<Vector<D>>& nodal)
    {
      return affine_field_of_vertices<D>(mesh.shapes[cell],
                                         [&](int k) -> decltype(auto) { return value_of(nodal, cell, k); });
    };
    const AffineField<D> velocity = in_cell(field.velocity);
    if (options.transfer == Transfer::affine)
      scratch.motion[r - batch.first_run] = {0, velocity, scaled<D>(velocity, options.dt)};
    else
      scratch.motion[r - batch.first_run] = {1 - options.pic_fraction, in_cell(field.velocity_change),
                                             scaled<D>(velocity, options.dt)};
  }
  for (std::size_t r = batch.last_run - batch.first_run; r % lanes != 0; ++r)
    scratch.motion[r] = {}; // strains of several cells are found together: lanes beyond the last run stand still
}
} // namespace

template <class G, int D>
void find_motions(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                  const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
{
  with_values_of_vertices(mesh, field,
                          [&](auto&& value_of) { find_motions(mesh, field, runs, options, batch, value_of, scratch); });
}

namespace
{
/// Strains of the cells of a batch, from the displacements.
template <class G, int D = G::dim>
void find_cell_strains(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                       const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch)
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
    const std::size_t last = std::min(n, first + lanes);
    if constexpr (G::has_hoop)
    {
      Lanes hoop{};
      for (std::size_t r = first; r < last; ++r)
        hoop[r - first] =
            scratch.motion[r].displacement.value[0] / mesh.shapes[runs[batch.first_run + r].cell].centre[0];
      add_hoop(strain, hoop);
    }
    if (options.nmd)
    {
      Lanes theta{};
      for (std::size_t r = first; r < last; ++r)
        theta[r - first] =
            averaged_strain<G>(mesh, field, runs[batch.first_run + r].cell, strain.volumetric[r - first]);
      set_volumetric<G>(strain, theta);
    }
    if (options.small)
      make_small<D>(strain);
  }
}

} // namespace

template <class G, int D>
void strain_cells(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                  const PassOptions& options, const Batch& batch, Particles<D>& particles, BatchScratch<D>& scratch)
{
  find_cell_strains(mesh, field, runs, options, batch, scratch);
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = runs[r];
    const CellStrain<D> strain = scratch.cell_strain(r - batch.first_run);
    for (Index i = run.first - batch.first; i < run.last - batch.first;
         i += lanes) // the next run overwrites the excess
      for (int k : working_component<G>)
        std::fill_n(scratch.strain[k] + i, lanes, strain.increment[k]);
    strain_particles<D>(particles, run.first, run.last, strain);
  }
}

template <class G, int D>
void strain_dual_domains(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                         const PassOptions& options, const Batch& batch, Particles<D>& particles,
                         BatchScratch<D>& scratch)
{
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = runs[r];
    for (Index p = run.first; p < run.last; ++p)
    {
      const Matrix<D> gradient = dual_gradient(mesh, field, at<D>(particles.position, p), run.cell);
      CellStrain<D> strain = strain_increment<D>(gradient, options.dt);
      if (options.nmd)
        set_volumetric<G>(strain, averaged_strain<G>(mesh, field, run.cell, strain.volumetric));
      for (int k = 0; k < n_stress<D>; ++k)
        scratch.strain[k][p - batch.first] = strain.increment[k];
      scratch.deformation[p - batch.first] =
          deformation_of<D>(scaled<D>({{}, gradient}, options.dt).gradient, strain.volumetric);
      strain_particles<D>(particles, p, p + 1, strain);
    }
  }
}
#define INSTANTIATE(G)                                                                                                 \
  template void find_motions(const Mesh<G::dim>&, const VelocityField<G>&, const std::vector<Run>&,                    \
                             const PassOptions&, const Batch&, BatchScratch<G::dim>&);                                 \
  template void strain_cells(const Mesh<G::dim>&, const VelocityField<G>&, const std::vector<Run>&,                    \
                             const PassOptions&, const Batch&, Particles<G::dim>&, BatchScratch<G::dim>&);             \
  template void strain_dual_domains(const Mesh<G::dim>&, const VelocityField<G>&, const std::vector<Run>&,             \
                                    const PassOptions&, const Batch&, Particles<G::dim>&, BatchScratch<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
