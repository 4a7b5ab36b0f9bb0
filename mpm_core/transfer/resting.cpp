#include "transfer/resting.h"

#include "particles/seed.h"

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

template <int D>
void move_row(Particles<D>& particles, Index row, const CellMotion<D>& motion)
{
  const auto& [flip, change, displacement] = motion;
  for (int a = 0; a < D; ++a)
  {
    particles.velocity[a][row] = flip * particles.velocity[a][row] + change.value[a];
    particles.initial_position[a][row] -= displacement.value[a];
    particles.resting_displacement[a][row] += displacement.value[a];
    for (int b = 0; b < D; ++b)
    {
      double& gradient = particles.velocity_gradient[a * D + b][row];
      gradient = flip * gradient + change.gradient[a][b];
      particles.displacement_gradient[a * D + b][row] += displacement.gradient[a][b];
    }
  }
}

#define INSTANTIATE(D)                                                                                                 \
  template const RuleMoments<D>& rule_moments<D>(int, Rules<D>&);                                                      \
  template std::array<double, n_symmetric<D>> second_moment(const Mesh<D>&, Index, double, const RuleMoments<D>&);     \
  template void move_row(Particles<D>&, Index, const CellMotion<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
template void take_row(const Particles<2>&, Index, CellMoments<PlaneStrain>&);
template void take_row(const Particles<2>&, Index, CellMoments<Axisymmetric>&);
template void take_row(const Particles<3>&, Index, CellMoments<Solid>&);
} // namespace mpm::transfer
