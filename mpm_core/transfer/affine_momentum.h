#pragma once
/// @file
/// Affine transfer (APIC; Jiang, Schroeder & Teran 2017, An angular momentum conserving affine-particle-in-cell
/// method): a particle carries the gradient C_p of its velocity beside the velocity, and gives a node what it would
/// have there, m_p N_i (v_p + C_p (x_i - x_p)).
///
/// The velocity that a linear simplex gives its particles is affine, so that C_p is the gradient of the cell which they
/// were in: APIC and TPIC are the same there. As long as the particles of a node stay in their cells, it gets back the
/// velocity that it gave, however many steps they take; what is lost is lost where particles cross.

#include "transfer/moments.h"

namespace mpm::transfer
{
/// Positions of a cell's vertices from its centre.
template <int D>
std::array<Vector<D>, D + 1> vertices_from_centre(const Mesh<D>& mesh, Index cell)
{
  std::array<Vector<D>, D + 1> xi;
  for (int k = 0; k <= D; ++k)
    for (int a = 0; a < D; ++a)
      xi[k][a] = mesh.points[mesh.cells[cell][k]][a] - mesh.shapes[cell].centre[a];
  return xi;
}

/// sum m_p sum_k N_k(x_p) (x_k - x_p) (x) (x_k - x_p) over particles in a cell, from their moments.
template <class G, int D = G::dim>
Matrix<G::dim> spread_about_particles(const Mesh<G::dim>& mesh, Index cell, const CellMoments<G>& moments)
{
  const auto xi = vertices_from_centre(mesh, cell);
  const auto& gradient = mesh.shapes[cell].gradient;
  Matrix<D> sum;
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      sum[a][b] = -moments.mass_xixi[symmetric_index<D>(a, b)];
  for (int k = 0; k <= D; ++k)
  {
    const double mass = at_vertex<D>(moments.mass, moments.mass_xi, gradient[k]);
    for (int a = 0; a < D; ++a)
      for (int b = 0; b < D; ++b)
        sum[a][b] += mass * xi[k][a] * xi[k][b];
  }
  return sum;
}

/// Adds to the momentum of a cell what the affine part of its particles' velocities gives to the nodes: a change of the
/// first moment alone, as sum m_p N_i C_p (x_i - x_p) over the nodes is zero.
/// @param spread  of particles with this gradient, see `spread_about_particles`
template <class G, int D = G::dim>
void add_affine_momentum(const Matrix<G::dim>& gradient, const Matrix<G::dim>& spread, CellMoments<G>& moments)
{
  for (int a = 0; a < D; ++a)
    for (int b = 0; b < D; ++b)
      for (int d = 0; d < D; ++d)
        moments.momentum_xi[a][b] += gradient[a][d] * spread[d][b];
}

/// The same for the particles [first, last) of a cell, each with its own gradient.
template <class G, int D = G::dim>
void add_affine_momentum(const Mesh<D>& mesh, const Particles<D>& particles, Index first, Index last, Index cell,
                         CellMoments<G>& moments)
{
  if (!particles.velocity_gradient.present)
    return;
  const Vector<D>& centre = mesh.shapes[cell].centre;
  for (Index p = first; p < last; ++p)
  {
    CellMoments<G> own{};
    own.mass = particles.mass[p];
    Matrix<D> gradient;
    Vector<D> xi;
    for (int a = 0; a < D; ++a)
    {
      xi[a] = particles.position[a][p] - centre[a];
      own.mass_xi[a] = own.mass * xi[a];
      for (int b = 0; b < D; ++b)
        gradient[a][b] = particles.velocity_gradient[a * D + b][p];
    }
    for (int k = 0; k < n_symmetric<D>; ++k)
      own.mass_xixi[k] = own.mass_xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
    add_affine_momentum<G>(gradient, spread_about_particles(mesh, cell, own), moments);
  }
}
} // namespace mpm::transfer
