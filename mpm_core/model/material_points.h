#pragma once
/// @file
/// The particles as steps read them, in runs by cells, with the laws that they follow.

#include "materials/laws/point_moduli.h"
#include "model/model.h"

#include <array>

namespace mpm::model
{
/// A view of a model's particles.
template <int D>
struct MaterialPoints
{
  const Particles<D>& particles;
  const std::vector<Run>& runs;
  const std::vector<Law>& laws;
};

template <class G, int D = G::dim>
MaterialPoints<D> material_points(const Model<G>& model)
{
  return {model.particles, model.order.runs, model.laws};
}

/// The rows of resting cells likewise.
template <class G, int D = G::dim>
MaterialPoints<D> resting_points(const Model<G>& model)
{
  return {model.particles, model.fields.front().resting.runs, model.laws};
}

/// Calls f(mean stress, state) with those of a particle.
template <int D, class F>
auto with_stress_and_state(const Law& law, const Particles<D>& particles, Index p, F&& f)
{
  std::array<double, max_states> state;
  const auto n = static_cast<std::size_t>(n_state(law));
  for (std::size_t k = 0; k < n; ++k)
    state[k] = particles.state[k][p];
  return f((particles.stress[0][p] + particles.stress[1][p] + particles.stress[2][p]) / 3, std::span(state.data(), n));
}

/// Moduli of a particle as it is now [Pa]
template <int D>
WaveModuli moduli_of_particle(const Law& law, const Particles<D>& particles, Index p)
{
  return with_stress_and_state(law, particles, p,
                               [&](double mean_stress, std::span<const double> state)
                               { return moduli_of_point(law, mean_stress, state); });
}

/// Modulus from which the time step of a particle follows [Pa]
template <int D>
double limiting_modulus_of_particle(const Law& law, const Particles<D>& particles, Index p)
{
  return with_stress_and_state(law, particles, p,
                               [&](double mean_stress, std::span<const double> state)
                               { return limiting_modulus(law, mean_stress, state); });
}

/// Means of the moduli of the points of a run, by their volumes [Pa]
template <int D>
WaveModuli mean_moduli(const MaterialPoints<D>& points, const Run& run)
{
  const Law& law = points.laws[static_cast<std::size_t>(run.material)];
  if (!has_moduli_of_points(law))
    return {p_wave_modulus(law), shear_modulus(law)};
  double volume = 0, p_wave = 0, shear = 0;
  for (Index p = run.first; p < run.last; ++p)
  {
    const WaveModuli moduli = moduli_of_particle(law, points.particles, p);
    volume += points.particles.volume[p];
    p_wave += points.particles.volume[p] * moduli.p_wave;
    shear += points.particles.volume[p] * moduli.shear;
  }
  return {p_wave / volume, shear / volume};
}

/// Means of the moduli of the points in each of the first cells, by their volumes [Pa]; zero in empty cells. Particles
/// that came into a cell may be a run of their own there, until they are sorted.
template <int D>
std::vector<WaveModuli> moduli_of_cells(const MaterialPoints<D>& points, Index cells)
{
  std::vector<WaveModuli> sums(static_cast<std::size_t>(cells), WaveModuli{0, 0});
  std::vector<double> volumes(sums.size(), 0.0);
  for (const Run& run : points.runs)
  {
    double volume = 0;
    for (Index p = run.first; p < run.last; ++p)
      volume += points.particles.volume[p];
    const WaveModuli mean = mean_moduli(points, run);
    volumes[run.cell] += volume;
    sums[run.cell].p_wave += volume * mean.p_wave;
    sums[run.cell].shear += volume * mean.shear;
  }
  for (std::size_t c = 0; c < sums.size(); ++c)
    if (volumes[c] > 0)
      sums[c] = {sums[c].p_wave / volumes[c], sums[c].shear / volumes[c]};
  return sums;
}
} // namespace mpm::model
