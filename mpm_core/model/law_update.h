#pragma once
/// @file
/// Stresses of a batch by its law, once its strain increments are known.

#include "materials/laws/substeps.h"
#include "model/law_increment.h"
#include "model/particle_pass.h"

namespace mpm::model
{
/// A second chance for the particles whose law failed, unless the step is lost anyway.
template <class G, int D = G::dim>
void update_failed(Model<G>& model, const Batch& batch, const PointBatch<D>& points, const std::vector<Index>& failed)
{
  if (model.failure)
    return;
  const BatchReport report = update_in_parts<D>(model.laws[batch.material], points, failed);
  model.last.plastic += report.plastic;
  if (report.failed.empty())
    return;
  SymTensor<D> increment;
  for (int k = 0; k < n_stress<D>; ++k)
    increment[k] = points.strain_increment[k][report.failed.front()];
  note_failure<D>(model.failure, model.particles, Failure<D>::Kind::law_failed_in_parts,
                  batch.first + report.failed.front(), increment);
}

/// Updates the stresses and states of a batch.
/// @param material  whose runs the batch is of
/// @param strain    increments, one column per component
/// @param deform    gives the batch the increments of its deformation gradients, if its law needs them; a callable
///                  (material, columns, points)
template <class G, class Deform, int D = G::dim>
void update_law(Model<G>& model, const MaterialPoints<D>& material, const PassOptions& options, const Batch& batch,
                double (&strain)[n_stress<D>][batch_size + lanes], Deform&& deform)
{
  Particles<D>& particles = model.particles;
  PointBatch<D> points;
  points.size = batch.last - batch.first;
  for (int k = 0; k < n_stress<D>; ++k)
  {
    points.strain_increment[k] = strain[k];
    points.stress[k] = particles.stress[k].data() + batch.first;
  }
  std::array<double*, max_states> state;
  for (std::size_t k = 0; k < particles.state.size(); ++k)
    state[k] = particles.state[k].data() + batch.first;
  points.state = state.data();
  points.time = model.time;
  points.dt = options.law_dt;
  LawIncrement<D> columns;
  give_cell_sizes(model.mesh, material, batch, columns, points);
  if (!options.small)
    deform(material, columns, points);
  const BatchReport report = update<D>(model.laws[batch.material], points);
  model.last.plastic += report.plastic;
  if (!report.failed.empty())
    update_failed(model, batch, points, report.failed);
}
} // namespace mpm::model
