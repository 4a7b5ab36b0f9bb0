#pragma once
/// @file
/// Rotation of stresses, several at once.

#include "base/lanes.h"
#include "base/tensor.h"

namespace mpm::transfer
{
/// R sigma R^T for a piece whose first columns are the stresses without zz in plane strain.
/// @param r  one rotation for all lanes, or rows of Lanes
template <int D, std::size_t N, class Rotation>
inline void turn(Piece<N>& piece, const Rotation& r)
{
  std::array<std::array<Lanes, D>, D> half; // R sigma
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
    {
      half[i][j] = r[i][0] * piece[symmetric_index<D>(0, j)];
      for (int k = 1; k < D; ++k)
        half[i][j] += r[i][k] * piece[symmetric_index<D>(k, j)];
    }
  for (int s = 0; s < n_symmetric<D>; ++s)
  {
    const auto [i, j] = symmetric_pairs<D>[s];
    piece[s] = half[i][0] * r[j][0];
    for (int k = 1; k < D; ++k)
      piece[s] += half[i][k] * r[j][k];
  }
}
} // namespace mpm::transfer
