#pragma once
/// @file
/// The dual domain material point method (Zhang, Ma & Giguere 2011, J. Comput. Phys. 230, 6379): gradients of the shape
/// functions that are continuous over the sides of cells.
///
/// Of the gradient dN_i/dx at a place x, a fraction a(x) is that of the cell and the rest is taken from the nodes j of
/// the cell, N_j(x) times the mean of dN_i/dx over the cells that share j. This fraction is a bubble, zero on all sides
/// of the cell, so that a particle on its way into the next cell finds there what it had. All sums stay within a
/// particle's cell and its nodes, on simplices as on any element.
///
/// The stresses of the cell's part and of each node are means with the particles as weights, not sums. So a uniform
/// stress gives the exact force however unevenly the particles fill the cells.

#include "mesh/mesh.h"
#include "particles/particles.h"

#include <algorithm>

namespace mpm::transfer
{
/// The cell's fraction of the gradient at its centre, the bubble's largest value.
inline constexpr double dual_fraction = 0.5;

/// Mean of the bubble over a cell, over its largest value: (D+1)^(D+1) D! / (2D+1)!
template <int D>
inline constexpr double bubble_mean = D == 2 ? 27.0 / 60 : 256.0 / 840;

/// Weights at a place in a cell; their sum is 1.
template <int D>
struct DualWeights
{
  double cell;
  std::array<double, D + 1> node;
};

template <int D>
inline DualWeights<D> dual_weights(const CellShape<D>& shape, const Vector<D>& x)
{
  DualWeights<D> weights;
  double bubble = 1, sum = 0;
  for (int k = 0; k <= D; ++k)
  {
    double n = 1.0 / (D + 1);
    for (int i = 0; i < D; ++i)
      n += shape.gradient[k][i] * (x[i] - shape.centre[i]);
    weights.node[k] = std::max(n, 0.0); // a particle that has just left the cell counts as one on its side
    sum += weights.node[k];
  }
  for (double& n : weights.node)
    bubble *= (D + 1) * (n /= sum);
  weights.cell = dual_fraction * bubble;
  for (double& n : weights.node)
    n *= 1 - weights.cell;
  return weights;
}

/// Sums over particles for a mean stress, of a cell or a node; plain doubles, so that shared nodes are summed in one
/// message.
template <int D>
struct DualStress
{
  double volume;
  std::array<double, n_symmetric<D>> stress; ///< sum V_p sigma_p, weighted
};

/// Adds the particles [first, last) of one cell to its sum and to those of its nodes.
template <int D>
void add_dual_stress(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                     DualStress<D>& cell, const std::array<DualStress<D>*, D + 1>& nodes);

/// The mean stress that a cell integrates: its own part and that of its nodes.
template <int D>
std::array<double, n_symmetric<D>> dual_mean(const DualStress<D>& cell,
                                             const std::array<const DualStress<D>*, D + 1>& nodes);
} // namespace mpm::transfer
