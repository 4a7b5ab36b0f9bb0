#pragma once
/// @file
/// Sums over the particles of a cell for all of its vertices at once, from the moments of the cell.

#include "base/lanes.h"
#include "transfer/moments.h"

namespace mpm::transfer
{
/// A number for each vertex of a cell. In three dimensions they fill a vector, so that the sums for all vertices take
/// the instructions of one.
template <int D>
using ByVertex = std::conditional_t<D == 3, Lanes, std::array<double, D + 1>>;

/// Derivatives of a cell's shape functions by each coordinate
template <int D>
inline std::array<ByVertex<D>, D> gradients_by_vertex(const CellShape<D>& shape)
{
  std::array<ByVertex<D>, D> gradients;
  for (int b = 0; b < D; ++b)
    for (int k = 0; k <= D; ++k)
      gradients[b][k] = shape.gradient[k][b];
  return gradients;
}

template <int D>
inline void add(double factor, const ByVertex<D>& gradients, ByVertex<D>& sums)
{
  if constexpr (D == 3)
    sums += factor * gradients;
  else
    for (int k = 0; k <= D; ++k)
      sums[k] += factor * gradients[k];
}

/// sum over particles of q_p N_k(x_p) for all vertices k, from its zeroth and first moment
template <int D>
[[gnu::always_inline]] inline ByVertex<D> at_vertices(double zeroth, const Vector<D>& first,
                                                      const std::array<ByVertex<D>, D>& gradients)
{
  ByVertex<D> sums;
  for (int k = 0; k <= D; ++k)
    sums[k] = zeroth * (1.0 / (D + 1));
  for (int b = 0; b < D; ++b)
    add<D>(first[b], gradients[b], sums);
  return sums;
}

/// f_int of all vertices of a cell in a direction; by the hoop stress it is the same for all, and radial
template <class G>
inline ByVertex<G::dim> internal_forces(const Working<G>& stress, int a,
                                        const std::array<ByVertex<G::dim>, G::dim>& gradients,
                                        const CellShape<G::dim>& shape)
{
  constexpr int D = G::dim;
  ByVertex<D> forces{};
  if constexpr (G::has_hoop)
    if (a == 0)
      forces.fill(stress[n_symmetric<D>] * hoop_gradient<G>(shape));
  for (int b = 0; b < D; ++b)
    add<D>(stress[symmetric_index<D>(a, b)], gradients[b], forces);
  return forces;
}
} // namespace mpm::transfer
