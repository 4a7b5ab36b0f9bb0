#include "transfer/kinematics.h"

#include "base/lanes.h"
#include "mesh/search.h"
#include "transfer/turn.h"

#include <algorithm>

namespace mpm::transfer
{
namespace
{
/// Moves the particles of one piece: positions, then velocities, by component. Marks those not inside of the cell.
template <int D>
inline void move_piece(Piece<2 * D>& piece, const CellShape<D>& shape, const CellMotion<D>& motion, LaneMask& outside)
{
  std::array<Lanes, D> xi, moved;
  for (int i = 0; i < D; ++i)
    xi[i] = piece[i] - shape.centre[i];
  for (int a = 0; a < D; ++a)
  {
    Lanes change = motion.change.value[a] + motion.change.gradient[a][0] * xi[0];
    Lanes u = motion.displacement.value[a] + motion.displacement.gradient[a][0] * xi[0];
    for (int b = 1; b < D; ++b)
    {
      change += motion.change.gradient[a][b] * xi[b];
      u += motion.displacement.gradient[a][b] * xi[b];
    }
    moved[a] = xi[a] + u;
    piece[a] += u;
    piece[D + a] = motion.flip_fraction * piece[D + a] + change;
  }
  for (int k = 0; k <= D; ++k)
  {
    Lanes n = 1.0 / (D + 1) + shape.gradient[k][0] * moved[0];
    for (int i = 1; i < D; ++i)
      n += shape.gradient[k][i] * moved[i];
    outside |= ~(n >= -inside_tolerance); // so also where a coordinate is not a number
  }
}
} // namespace

template <int D>
bool move_particles(Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                    const CellMotion<D>& motion)
{
  std::array<double*, 2 * D> columns;
  for (int i = 0; i < D; ++i)
  {
    columns[i] = particles.position[i].data();
    columns[D + i] = particles.velocity[i].data();
  }
  const CellShape<D> cell = shape; // copies that no store can alias
  const CellMotion<D> m = motion;
  LaneMask outside{};
  change_lanes<D == 2>(columns, first, last, [&](Piece<2 * D>& piece) { move_piece<D>(piece, cell, m, outside); });
  std::int64_t any = 0;
  for (int l = 0; l < lanes; ++l)
    any |= outside[l];
  return any == 0;
}

template <int D>
void count_displacement(Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                        const CellMotion<D>& motion)
{
  for (Index p = first; p < last; ++p)
    for (int a = 0; a < D; ++a)
    {
      double u = motion.displacement.value[a];
      for (int b = 0; b < D; ++b)
        u += motion.displacement.gradient[a][b] * (particles.position[b][p] - shape.centre[b]);
      particles.initial_position[a][p] -= u;
    }
}

template <int D>
void rotate(const SymmetricColumns<D>& stress, Index first, Index last, const Matrix<D>& rotation)
{
  const Matrix<D> r = rotation; // a copy that no store can alias
  change_lanes<false>(stress, first, last, [&r](Piece<n_symmetric<D>>& piece) { turn<D>(piece, r); });
}

template <int D>
void strain_particles(Particles<D>& particles, Index first, Index last, const CellStrain<D>& strain)
{
  constexpr int S = n_symmetric<D>;
  const auto columns = strain_columns(particles);
  const double growth = 1 + strain.volumetric, increment = strain.deviatoric;
  const Matrix<D> r = strain.rotation; // a copy that no store can alias
  change_lanes<D == 2>(columns, first, last,
                       [&r, growth, increment](Piece<S + 2>& piece)
                       {
                         turn<D>(piece, r);
                         piece[S] *= growth;
                         piece[S + 1] += increment;
                       });
}

#define INSTANTIATE(D)                                                                                                 \
  template bool move_particles(Particles<D>&, Index, Index, const CellShape<D>&, const CellMotion<D>&);                \
  template void count_displacement(Particles<D>&, Index, Index, const CellShape<D>&, const CellMotion<D>&);            \
  template void rotate<D>(const SymmetricColumns<D>&, Index, Index, const Matrix<D>&);                                 \
  template void strain_particles(Particles<D>&, Index, Index, const CellStrain<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::transfer
