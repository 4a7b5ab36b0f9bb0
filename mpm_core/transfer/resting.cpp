#include "transfer/resting.h"

#include "particles/seed.h"

namespace mpm::transfer
{
template <int D>
const Rule<D>& rule_of(int points, Rules<D>& rules)
{
  const auto known = rules.find(points);
  return known != rules.end() ? known->second : rules.emplace(points, even_points<D>(points)).first->second;
}

template <class G, int D>
std::vector<double> rule_weights(const Mesh<D>& mesh, Index cell, const Rule<D>& rule)
{
  std::vector<double> weights;
  double sum = 0;
  for (const auto& point : rule)
    sum += weights.emplace_back(thickness<G>(point_in_cell<D>(mesh, cell, point)));
  for (double& weight : weights)
    weight /= sum;
  return weights;
}

template <class G, int D>
void take_mass(const Mesh<D>& mesh, Index cell, double mass, const Rule<D>& rule, CellMoments<G>& moments)
{
  const std::vector<double> weights = rule_weights<G>(mesh, cell, rule);
  moments.mass = mass;
  moments.mass_xi = {};
  moments.mass_xixi = {};
  for (std::size_t p = 0; p < rule.size(); ++p)
  {
    Vector<D> xi = point_in_cell<D>(mesh, cell, rule[p]);
    for (int i = 0; i < D; ++i)
    {
      xi[i] -= mesh.shapes[cell].centre[i];
      if constexpr (G::has_hoop) // zero elsewhere, but for round-off
        moments.mass_xi[i] += mass * weights[p] * xi[i];
    }
    for (int s = 0; s < n_symmetric<D>; ++s)
      moments.mass_xixi[s] += mass * weights[p] * xi[symmetric_pairs<D>[s][0]] * xi[symmetric_pairs<D>[s][1]];
  }
}

template <class G, int D>
void take_row(const Particles<D>& particles, Index row, CellMoments<G>& moments)
{
  const double volume = particles.volume[row];
  moments.volume = volume;
  moments.mass = particles.mass[row];
  for (int k = 0; k < G::n_working; ++k)
    moments.stress[k] = volume * particles.stress[working_component<G>[k]][row];
  const Matrix<D> gradient = gradient_at<D>(particles.velocity_gradient, row);
  for (int a = 0; a < D; ++a)
  {
    const double velocity = particles.velocity[a][row];
    moments.momentum[a] = moments.mass * velocity + dot<D>(gradient[a], moments.mass_xi);
    for (int b = 0; b < D; ++b)
    {
      double sum = velocity * moments.mass_xi[b];
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
  template const Rule<D>& rule_of<D>(int, Rules<D>&);                                                                  \
  template void move_row(Particles<D>&, Index, const CellMotion<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
#undef INSTANTIATE
#define INSTANTIATE(G)                                                                                                 \
  template std::vector<double> rule_weights<G>(const Mesh<G::dim>&, Index, const Rule<G::dim>&);                       \
  template void take_mass(const Mesh<G::dim>&, Index, double, const Rule<G::dim>&, CellMoments<G>&);                   \
  template void take_row(const Particles<G::dim>&, Index, CellMoments<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::transfer
