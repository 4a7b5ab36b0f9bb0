#pragma once
/// @file
/// What PIC takes out of the motion of particles, or of the water in them.

#include "model/velocity_field.h"
#include "transfer/affine_field.h"

namespace mpm::model
{
/// Kinetic energy that PIC takes out of the particles of a run: their own velocities v go towards those of the nodes,
/// v + s (w - v), which costs m s d . (v - s d / 2) with d = v - w.
/// @param mass         of each particle [kg]
/// @param velocity_of  a callable (Index particle, int component) -> double
template <class G, class VelocityOf, int D = G::dim>
double pic_loss(const Mesh<D>& mesh, const Particles<D>& particles, const VelocityField<G>& field, const Run& run,
                double pic_fraction, const double* mass, VelocityOf&& velocity_of)
{
  const auto start = [&](Index i) -> const Vector<D>& { return field.start_velocity[i]; };
  const AffineField<D> nodal = affine_field<D>(mesh, run.cell, start);
  const Vector<D>& centre = mesh.shapes[run.cell].centre;
  double sum = 0;
  for (Index p = run.first; p < run.last; ++p)
    for (int a = 0; a < D; ++a)
    {
      double w = nodal.value[a];
      for (int b = 0; b < D; ++b)
        w += nodal.gradient[a][b] * (particles.position[b][p] - centre[b]);
      const double v = velocity_of(p, a), change = pic_fraction * (v - w);
      sum += mass[p] * change * (v - 0.5 * change);
    }
  return sum;
}
} // namespace mpm::model
