#pragma once
/// @file
/// What a law is given of the increment of a batch beyond stress and strain, where it needs it.

#include "model/material_points.h"
#include "particles/batches.h"

namespace mpm::model
{
/// Columns of a batch; touched only where the law needs them.
template <int D>
struct LawIncrement
{
  std::array<double, batch_size> cell_size;
  std::array<std::array<double, batch_size>, D * D> deformation;
};

/// Gives a batch the sizes of its particles' cells, if its law needs them.
template <int D>
void give_cell_sizes(const Mesh<D>& mesh, const MaterialPoints<D>& material, const Batch& batch,
                     LawIncrement<D>& columns, PointBatch<D>& points)
{
  if (!needs(material.laws[batch.material]).cell_size)
    return;
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = material.runs[r];
    const double size = cell_size<D>(mesh.shapes[run.cell].volume);
    std::fill_n(columns.cell_size.data() + (run.first - batch.first), run.last - run.first, size);
  }
  points.cell_size = columns.cell_size.data();
}

/// Increment of the deformation gradient of a displacement gradient, whose trace a volumetric strain takes the place
/// of.
template <int D>
Matrix<D> deformation_of(Matrix<D> gradient, double volumetric)
{
  for (int a = 0; a < D; ++a)
    volumetric -= gradient[a][a];
  for (int a = 0; a < D; ++a)
    gradient[a][a] += 1 + volumetric / D;
  return gradient;
}

/// Gives a batch the increments of its particles' deformation gradients, if its law needs them.
/// @pre not in axial symmetry, which `set_laws` refuses such laws in: there is no place for the hoop
/// @param gradient  function of the number of a run in the batch that returns its displacement gradient
/// @param volumetric  the same of its volumetric strain, which takes the place of the gradient's trace
template <int D, class Gradient, class Volumetric>
void give_deformation(const MaterialPoints<D>& material, const Batch& batch, const Gradient& gradient,
                      const Volumetric& volumetric, LawIncrement<D>& columns, PointBatch<D>& points)
{
  if (!needs(material.laws[batch.material]).deformation)
    return;
  for (std::size_t r = batch.first_run; r < batch.last_run; ++r)
  {
    const Run& run = material.runs[r];
    const Matrix<D> f = deformation_of<D>(gradient(r - batch.first_run), volumetric(r - batch.first_run));
    for (int k = 0; k < D * D; ++k)
      std::fill_n(columns.deformation[k].data() + (run.first - batch.first), run.last - run.first, f[k / D][k % D]);
  }
  for (int k = 0; k < D * D; ++k)
    points.deformation[k] = columns.deformation[k].data();
}

/// The same where the particles of a cell differ.
/// @param deformation  of each particle of the batch
template <int D>
void give_deformation(const MaterialPoints<D>& material, const Batch& batch, std::span<const Matrix<D>> deformation,
                      LawIncrement<D>& columns, PointBatch<D>& points)
{
  if (!needs(material.laws[batch.material]).deformation)
    return;
  for (int k = 0; k < D * D; ++k)
  {
    for (Index i = 0; i < batch.last - batch.first; ++i)
      columns.deformation[k][i] = deformation[static_cast<std::size_t>(i)][k / D][k % D];
    points.deformation[k] = columns.deformation[k].data();
  }
}
} // namespace mpm::model
