#pragma once
/// @file
/// What the nodes do to the particles of a batch: motions of its cells, and strains of its particles.

#include "base/lanes.h"
#include "model/particle_pass.h"
#include "particles/batches.h"

#include <bit>

namespace mpm::model
{
/// Scratch of a batch, in the first-level cache.
template <int D>
struct BatchScratch
{
  std::array<CellMotion<D>, batch_size> motion;               ///< per run
  std::array<Matrix<D>, batch_size> carried;                  ///< per run: gradients that its particles carry (affine)
  std::array<CellStrain<D, Lanes>, batch_size / lanes> cells; ///< per run, `lanes` of them together
  /// Per particle, one column per component; that out of plane stays zero
  alignas(64) double strain[n_stress<D>][batch_size + lanes];
  /// Per particle, where those of a cell differ (dual domains): increment of the deformation gradient
  std::array<Matrix<D>, batch_size> deformation;
  /// Per run, one column per component: sum V_p sigma_p of its particles before and after the strain
  alignas(64) double stress_before[n_stress<D>][batch_size], stress_after[n_stress<D>][batch_size];

  CellStrain<D> cell_strain(std::size_t run) const
  {
    constexpr std::size_t members = sizeof(CellStrain<D>) / sizeof(double);
    const auto& together = reinterpret_cast<const std::array<double[lanes], members>&>(cells[run / lanes]);
    std::array<double, members> numbers;
    for (std::size_t k = 0; k < members; ++k)
      numbers[k] = together[k][run % lanes];
    return std::bit_cast<CellStrain<D>>(numbers);
  }
};

/// What the nodes of a field do to the particles of each run of a batch.
template <class G, int D = G::dim>
void find_motions(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                  const PassOptions& options, const Batch& batch, BatchScratch<D>& scratch);

/// Strains the particles of a batch, those of a cell alike: rotates their stresses, grows their volumes, and leaves
/// their strain increments in the scratch, for the law.
/// @pre find_motions has been called for the batch
template <class G, int D = G::dim>
void strain_cells(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                  const PassOptions& options, const Batch& batch, Particles<D>& particles, BatchScratch<D>& scratch);

/// The same for each particle by the gradient at its own place.
/// @pre average_gradients has been called for the field
template <class G, int D = G::dim>
void strain_dual_domains(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                         const PassOptions& options, const Batch& batch, Particles<D>& particles,
                         BatchScratch<D>& scratch);
} // namespace mpm::model
