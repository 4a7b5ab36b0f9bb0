#include "transfer/resting.h"

#include "particles/seed.h"
#include "transfer/kinematics.h"
#include "transfer/lanes.h"
#include "transfer/turn.h"

namespace mpm::transfer
{
template <int D>
const RuleMoments<D>& rule_moments(int points, Rules<D>& rules)
{
  const auto known = rules.find(points);
  if (known != rules.end())
    return known->second;
  RuleMoments<D> moments{};
  for (const auto& point : even_points<D>(points))
    for (int k = 0; k <= D; ++k)
      for (int l = 0; l <= D; ++l)
        moments[k][l] += point[k] * point[l] / points;
  return rules[points] = moments;
}

template <int D>
std::array<double, n_symmetric<D>> second_moment(const Mesh<D>& mesh, Index cell, double mass,
                                                 const RuleMoments<D>& rule)
{
  std::array<Vector<D>, D + 1> arm;
  for (int k = 0; k <= D; ++k)
    for (int i = 0; i < D; ++i)
      arm[k][i] = mesh.points[mesh.cells[cell][k]][i] - mesh.shapes[cell].centre[i];
  std::array<double, n_symmetric<D>> sum{};
  for (int s = 0; s < n_symmetric<D>; ++s)
  {
    const auto [i, j] = symmetric_pairs<D>[s];
    for (int k = 0; k <= D; ++k)
      for (int l = 0; l <= D; ++l)
        sum[s] += mass * rule[k][l] * arm[k][i] * arm[l][j];
  }
  return sum;
}

template <class G, int D>
void take_row(const Particles<D>& particles, Index row, CellMoments<G>& moments)
{
  const double mass = particles.mass[row], volume = particles.volume[row];
  moments.volume = volume;
  moments.mass = mass;
  moments.mass_xi = {};
  for (int k = 0; k < G::n_working; ++k)
    moments.stress[k] = volume * particles.stress[working_component<G>[k]][row];
  const Matrix<D> gradient = gradient_at<D>(particles.velocity_gradient, row);
  for (int a = 0; a < D; ++a)
  {
    moments.momentum[a] = mass * particles.velocity[a][row];
    for (int b = 0; b < D; ++b)
    {
      double sum = 0;
      for (int c = 0; c < D; ++c)
        sum += gradient[a][c] * moments.mass_xixi[symmetric_index<D>(c, b)];
      moments.momentum_xi[a][b] = sum;
    }
  }
}

namespace
{
/// Calls `change(piece, group)` on consecutive rows, `lanes` of them together, and writes them back.
template <std::size_t N, class Change>
void change_rows(const std::array<double*, N>& columns, Index first, Index last, Change&& change)
{
  for (Index i = first; i < last; i += lanes)
  {
    const int count = std::min<Index>(lanes, last - i);
    Piece<N> piece = count == lanes ? load(columns, i) : load_few(columns, i, last);
    change(piece, static_cast<std::size_t>(i - first));
    if (count == lanes)
      for (std::size_t k = 0; k < N; ++k)
        std::memcpy(columns[k] + i, &piece[k], sizeof(Lanes));
    else
      for (std::size_t k = 0; k < N; ++k)
        for (int l = 0; l < count; ++l)
          columns[k][i + l] = piece[k][l];
  }
}

/// Columns that the motion of rows changes: velocity, initial position, displacement, and the two gradients.
template <int D>
std::array<double*, 3 * D + 2 * D * D> motion_columns(Particles<D>& particles)
{
  std::array<double*, 3 * D + 2 * D * D> columns;
  std::size_t k = 0;
  for (auto* vectors : {&particles.velocity, &particles.initial_position, &particles.resting_displacement.columns})
    for (Column& column : *vectors)
      columns[k++] = column.data();
  for (auto* gradients : {&particles.velocity_gradient, &particles.displacement_gradient})
    for (Column& column : gradients->columns)
      columns[k++] = column.data();
  return columns;
}
} // namespace

template <int D>
Index move_rows(Particles<D>& particles, Index first, std::span<const CellMotion<D>> motions)
{
  const Index last = first + static_cast<Index>(motions.size());
  Index failed = last;
  const auto move_piece = [&](Piece<3 * D + 2 * D * D>& piece, std::size_t group)
  {
    std::array<const CellMotion<D>*, lanes> of;
    for (std::size_t l = 0; l < lanes; ++l)
      of[l] = &motions[std::min(group + l, motions.size() - 1)];
    static_assert(lanes == 4);
    const auto each = [&of](auto&& number) -> Lanes {
      return Lanes{number(*of[0]), number(*of[1]), number(*of[2]), number(*of[3])};
    };
    const double flip = of[0]->flip_fraction;
    for (int a = 0; a < D; ++a)
    {
      const Lanes u = each([a](const CellMotion<D>& m) { return m.displacement.value[a]; });
      piece[a] = flip * piece[a] + each([a](const CellMotion<D>& m) { return m.change.value[a]; });
      piece[D + a] -= u;
      piece[2 * D + a] += u;
      for (int b = 0; b < D; ++b)
      {
        Lanes& gradient = piece[3 * D + a * D + b];
        gradient = flip * gradient + each([a, b](const CellMotion<D>& m) { return m.change.gradient[a][b]; });
        piece[3 * D + D * D + a * D + b] +=
            each([a, b](const CellMotion<D>& m) { return m.displacement.gradient[a][b]; });
      }
    }
    for (int l = 0; l < lanes; ++l)
      for (int a = 0; a < D; ++a)
        if (!std::isfinite(piece[a][l]))
          failed = std::min(failed, std::min(first + static_cast<Index>(group) + l, last - 1));
  };
  change_rows(motion_columns(particles), first, last, move_piece);
  return failed;
}

template <int D>
void strain_rows(Particles<D>& particles, Index first, Index last, std::span<const CellStrain<D, Lanes>> strains)
{
  constexpr int S = n_symmetric<D>;
  change_rows(strain_columns(particles), first, last,
              [&](Piece<S + 2>& piece, std::size_t group)
              {
                const CellStrain<D, Lanes>& strain = strains[group / lanes];
                turn<D>(piece, strain.rotation);
                piece[S] *= 1 + strain.volumetric;
                piece[S + 1] += strain.deviatoric;
              });
}

#define INSTANTIATE(D)                                                                                                 \
  template const RuleMoments<D>& rule_moments<D>(int, Rules<D>&);                                                      \
  template std::array<double, n_symmetric<D>> second_moment(const Mesh<D>&, Index, double, const RuleMoments<D>&);     \
  template Index move_rows(Particles<D>&, Index, std::span<const CellMotion<D>>);                                      \
  template void strain_rows(Particles<D>&, Index, Index, std::span<const CellStrain<D, Lanes>>);
INSTANTIATE(2)
INSTANTIATE(3)
template void take_row(const Particles<2>&, Index, CellMoments<PlaneStrain>&);
template void take_row(const Particles<2>&, Index, CellMoments<Axisymmetric>&);
template void take_row(const Particles<3>&, Index, CellMoments<Solid>&);
} // namespace mpm::transfer
