#include "transfer/kinematics.h"

#include "mesh/search.h"
#include "transfer/lanes.h"

#include <algorithm>

namespace mpm
{
namespace
{
/// The motion inside a cell, affine: value + gradient . xi. Change of velocity first, then displacement.
template <int D>
struct CellMotion
{
  std::array<double, 2 * D> value{};
  std::array<std::array<double, 2 * D>, D> gradient{}; ///< [component of xi]
};

template <int D>
CellMotion<D> cell_motion(const Mesh<D>& mesh, Index cell, std::span<const NodalMotion<D>> motion)
{
  CellMotion<D> result;
  for (int k = 0; k <= D; ++k)
  {
    const NodalMotion<D>& node = motion[mesh.cells[cell][k]];
    const Vector<D>& gradient = mesh.shapes[cell].gradient[k];
    for (int w = 0; w < 2 * D; ++w)
      result.value[w] += node[w];
    for (int b = 0; b < D; ++b)
      for (int w = 0; w < 2 * D; ++w)
        result.gradient[b][w] += gradient[b] * node[w];
  }
  for (int w = 0; w < 2 * D; ++w)
    result.value[w] *= 1.0 / (D + 1);
  return result;
}

/// Positions and velocities, by component.
template <int D>
using MotionColumns = std::array<double*, 2 * D>;

/// Moves the particles of one piece from lane `first` on.
/// @returns number of those that are not inside of the cell
template <int D>
inline int move_lanes(const MotionColumns<D>& at, int first, const CellShape<D>& shape, const CellMotion<D>& motion,
                      double keep)
{
  const CellShape<D> cell = shape; // copies that no store can alias
  const CellMotion<D> m = motion;
  int outside = 0;
#pragma GCC ivdep
  for (int l = 0; l < lanes; ++l)
  {
    const bool mine = l >= first;
    double xi[D], moved[D];
    for (int i = 0; i < D; ++i)
      xi[i] = at[i][l] - cell.centre[i];
    for (int a = 0; a < D; ++a)
    {
      double change = m.value[a], u = m.value[D + a];
      for (int b = 0; b < D; ++b)
      {
        change += m.gradient[b][a] * xi[b];
        u += m.gradient[b][D + a] * xi[b];
      }
      moved[a] = xi[a] + u;
      if (mine)
      {
        at[a][l] += u;
        at[D + a][l] = keep * at[D + a][l] + change;
      }
    }
    bool inside = true; // false also where a coordinate is not a number
    for (int k = 0; k <= D; ++k)
    {
      double n = 1.0 / (D + 1);
      for (int i = 0; i < D; ++i)
        n += cell.gradient[k][i] * moved[i];
      inside &= n >= -inside_tolerance;
    }
    outside += mine & !inside ? 1 : 0;
  }
  return outside;
}
} // namespace

template <int D>
int move_particles(Particles<D>& particles, const Run& run, const Mesh<D>& mesh, std::span<const NodalMotion<D>> motion,
                   double keep)
{
  const CellShape<D>& shape = mesh.shapes[run.cell];
  const CellMotion<D> cell = cell_motion<D>(mesh, run.cell, motion);
  MotionColumns<D> columns;
  for (int i = 0; i < D; ++i)
  {
    columns[i] = particles.position[i].data();
    columns[D + i] = particles.velocity[i].data();
  }
  int outside = 0;
  for_each_lanes(columns, run.first, run.last,
                 [&](const MotionColumns<D>& at, int first)
                 { outside += move_lanes<D>(at, first, shape, cell, keep); });
  return outside;
}

namespace
{
/// R sigma R^T for lane l of stress columns.
template <int D, std::size_t N>
inline std::array<double, n_symmetric<D>> turned(const std::array<double*, N>& stress, int l, const Matrix<D>& r)
{
  double half[D][D]; // R sigma
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
    {
      half[i][j] = 0;
      for (int k = 0; k < D; ++k)
        half[i][j] += r[i][k] * stress[symmetric_index<D>(k, j)][l];
    }
  std::array<double, n_symmetric<D>> result{};
  for (int k = 0; k < n_symmetric<D>; ++k)
    for (int j = 0; j < D; ++j)
      result[k] += half[symmetric_pairs<D>[k][0]][j] * r[symmetric_pairs<D>[k][1]][j];
  return result;
}
} // namespace

template <int D>
void rotate(const SymmetricColumns<D>& stress, Index first, Index last, const Matrix<D>& rotation)
{
  const Matrix<D> r = rotation; // a copy that no store can alias
  for_each_lanes(stress, first, last,
                 [&r](const SymmetricColumns<D>& at, int own)
                 {
#pragma GCC ivdep
                   for (int l = 0; l < lanes; ++l)
                   {
                     const auto result = turned<D>(at, l, r);
                     if (l >= own)
                       for (int k = 0; k < n_symmetric<D>; ++k)
                         at[k][l] = result[k];
                   }
                 });
}

template <int D>
void strain_particles(Particles<D>& particles, Index first, Index last, const CellStrain<D>& strain)
{
  constexpr int S = n_symmetric<D>;
  std::array<double*, S + 2> columns;
  for (int k = 0; k < S; ++k)
    columns[k] = particles.stress[stress_component<D>[k]].data();
  columns[S] = particles.volume.data();
  columns[S + 1] = particles.deviatoric_strain.data();
  const double growth = 1 + strain.volumetric, increment = strain.deviatoric;
  const Matrix<D> r = strain.rotation; // a copy that no store can alias
  for_each_lanes(columns, first, last,
                 [&r, growth, increment](const std::array<double*, S + 2>& at, int own)
                 {
#pragma GCC ivdep
                   for (int l = 0; l < lanes; ++l)
                   {
                     const auto stress = turned<D>(at, l, r);
                     if (l >= own)
                     {
                       for (int k = 0; k < S; ++k)
                         at[k][l] = stress[k];
                       at[S][l] *= growth;
                       at[S + 1][l] += increment;
                     }
                   }
                 });
}

#define INSTANTIATE(D)                                                                                                 \
  template int move_particles<D>(Particles<D>&, const Run&, const Mesh<D>&, std::span<const NodalMotion<D>>, double);  \
  template void rotate<D>(const SymmetricColumns<D>&, Index, Index, const Matrix<D>&);                                 \
  template void strain_particles(Particles<D>&, Index, Index, const CellStrain<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
