#pragma once
/// @file
/// What the nodes need to know of a resting cell, from its one row.
///
/// A resting cell stands for n particles of equal mass at the points of a rule (`even_points`), which do not move
/// relative to the cell. Its moments are those of these particles: volume and mass of the row, no first moment of mass,
/// the second moment of the rule, and the velocities v + grad v . xi. So nodes cannot tell a resting cell from its
/// particles, and nothing changes for them when one takes the place of the other.

#include "transfer/cell_strain.h"
#include "transfer/moments.h"

#include <map>

namespace mpm::transfer
{
/// Mean of N_k N_l over the points of a rule.
template <int D>
using RuleMoments = std::array<std::array<double, D + 1>, D + 1>;

/// By the number of points.
template <int D>
using Rules = std::map<int, RuleMoments<D>>;

/// @throws InputError a number of points that no rule has
template <int D>
const RuleMoments<D>& rule_moments(int points, Rules<D>& rules);

/// sum m_p xi (x) xi of a cell's particles at the points of a rule.
template <int D>
std::array<double, n_symmetric<D>> second_moment(const Mesh<D>& mesh, Index cell, double mass,
                                                 const RuleMoments<D>& rule);

/// Gives moments what the row of a resting cell says; the second moment of mass stays.
template <class G, int D = G::dim>
void take_row(const Particles<D>& particles, Index row, CellMoments<G>& moments);

/// Moves resting cells with the nodes: velocities as (18), while centres stay and displacements add up.
/// @param first    the first of consecutive rows
/// @param motions  of each of them
/// @returns the first row whose velocity is not finite; that behind the last if all are
template <int D>
Index move_rows(Particles<D>& particles, Index first, std::span<const CellMotion<D>> motions);

/// Rotates the stresses of consecutive rows, each with its cell, grows their volumes and accumulates their deviatoric
/// strain.
/// @param strains  of `lanes` rows together
template <int D>
void strain_rows(Particles<D>& particles, Index first, Index last, std::span<const CellStrain<D, Lanes>> strains);

/// Gradient in the row of a resting cell.
template <int D>
inline Matrix<D> gradient_at(const OptionalColumns<D * D>& columns, Index row)
{
  Matrix<D> gradient;
  for (int k = 0; k < D * D; ++k)
    gradient[k / D][k % D] = columns[static_cast<std::size_t>(k)][row];
  return gradient;
}

/// sum m_p a_p . b_p of two velocities a + A . xi and b + B . xi of a cell's particles, beyond what those of the centre
/// give: A : B (x) second moment. Twice the kinetic energy of motion relative to the centre where they are the same.
template <int D>
inline double relative_product(const Matrix<D>& a, const Matrix<D>& b,
                               const std::array<double, n_symmetric<D>>& second_moment)
{
  double sum = 0;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k)
        sum += a[i][j] * second_moment[symmetric_index<D>(j, k)] * b[i][k];
  return sum;
}
} // namespace mpm::transfer
