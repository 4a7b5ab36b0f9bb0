#pragma once
/// @file
/// Two ways to strain particles: those of a cell alike, or each by the gradient at its own place. They are siblings
/// that the pass over the particles takes as a parameter.

#include "model/batch_strain.h"
#include "model/law_increment.h"

namespace mpm::model
{
/// Half of the work of a batch's stresses on the strains in the scratch, particle by particle.
template <class G, int D = G::dim>
inline double half_work(const Particles<D>& particles, const Batch& batch, const BatchScratch<D>& scratch)
{
  double sum = 0;
  for (Index p = batch.first; p < batch.last; ++p)
    for (int k : working_component<G>)
      sum += particles.volume[p] * particles.stress[k][p] * scratch.strain[k][p - batch.first];
  return 0.5 * sum;
}

/// Half of the work of the runs' stresses on the strains of their cells, several runs at once.
/// @param stress  sums V_p sigma_p of the runs, by component
template <class G, int D = G::dim>
inline double half_work(const double (&stress)[n_stress<D>][batch_size], const BatchScratch<D>& scratch,
                        std::size_t runs)
{
  constexpr LaneMask number{0, 1, 2, 3};
  static_assert(lanes == 4);
  Lanes sum{};
  for (std::size_t r = 0; r < runs; r += lanes)
  {
    const LaneMask mine = number < static_cast<std::int64_t>(runs - r); // the lanes beyond hold what was there before
    for (std::size_t k = 0; k < G::n_working; ++k)
      sum += mine ? load(stress[k] + r) * scratch.cells[r / lanes].increment[working_component<G>[k]] : Lanes{};
  }
  return 0.5 * base::sum(sum);
}

/// Integration over particles, or mixed: volumes and work follow from the moments of a cell and its one strain.
struct StrainPerCell
{
  static constexpr bool moves_moments = true; ///< the moments of cells can follow the motion of the nodes

  template <class G, int D = G::dim>
  static void strain(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                     const PassOptions& options, const Batch& batch, Particles<D>& particles, BatchScratch<D>& scratch)
  {
    strain_cells(mesh, field, runs, options, batch, particles, scratch);
  }

  template <int D>
  static void deform(const MaterialPoints<D>& material, const Batch& batch, const BatchScratch<D>& scratch,
                     LawIncrement<D>& columns, PointBatch<D>& points)
  {
    give_deformation(
        material, batch, [&](std::size_t r) { return scratch.motion[r].displacement.gradient; },
        [&](std::size_t r) { return scratch.cells[r / lanes].volumetric[r % lanes]; }, columns, points);
  }

  template <class G, int D = G::dim>
  static double half_work_of_batch(const Particles<D>&, const Batch&, const BatchScratch<D>&)
  {
    return 0;
  }

  template <class G, int D = G::dim>
  static double half_work_of_runs(const double (&stress)[n_stress<D>][batch_size], const BatchScratch<D>& scratch,
                                  std::size_t runs)
  {
    return half_work<G>(stress, scratch, runs);
  }
};

/// Dual domains: each particle has its own strain and its own work.
struct StrainPerParticle
{
  static constexpr bool moves_moments = false;

  template <class G, int D = G::dim>
  static void strain(const Mesh<D>& mesh, const VelocityField<G>& field, const std::vector<Run>& runs,
                     const PassOptions& options, const Batch& batch, Particles<D>& particles, BatchScratch<D>& scratch)
  {
    strain_dual_domains(mesh, field, runs, options, batch, particles, scratch);
  }

  template <int D>
  static void deform(const MaterialPoints<D>& material, const Batch& batch, const BatchScratch<D>& scratch,
                     LawIncrement<D>& columns, PointBatch<D>& points)
  {
    give_deformation<D>(material, batch, std::span(std::as_const(scratch.deformation)), columns, points);
  }

  template <class G, int D = G::dim>
  static double half_work_of_batch(const Particles<D>& particles, const Batch& batch, const BatchScratch<D>& scratch)
  {
    return half_work<G>(particles, batch, scratch);
  }

  template <class G, int D = G::dim>
  static double half_work_of_runs(const double (&)[n_stress<D>][batch_size], const BatchScratch<D>&, std::size_t)
  {
    return 0;
  }
};
} // namespace mpm::model
