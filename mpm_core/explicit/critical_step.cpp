#include "explicit/critical_step.h"

#include "explicit/two_phase_step.h"

#include <cmath>

namespace mpm::explicit_scheme
{
namespace
{
/// Modulus over density of the compression wave in the soil of a particle, without water that moves by itself [m2/s2].
template <class G, int D = G::dim>
double wave_of_soil_squared(const Model<G>& model, Index p, double modulus)
{
  return modulus * model.particles.volume[p] / model.particles.mass[p];
}

/// Modulus over density of the fastest compression wave in a particle [m2/s2].
template <class G, int D = G::dim>
double wave_squared(const Model<G>& model, Index p, double modulus)
{
  if (!has_two_phases(model))
    return wave_of_soil_squared(model, p, modulus);
  const Particles<D>& particles = model.particles;
  const double volume = particles.volume[p];
  return fast_wave_squared(modulus, model.water->modulus, particles.porosity[0][p], particles.mass[p] / volume,
                           particles.water_mass[0][p] / volume);
}

/// The particle of this rank whose h_min / c is smallest.
/// @param speed_squared  c^2 [m2/s2] of a row with this modulus [Pa]; a callable (Index, double) -> double
template <class G, class SpeedSquared, int D = G::dim>
CriticalParticle particle_of_shortest_time(const Model<G>& model, SpeedSquared&& speed_squared)
{
  CriticalParticle found;
  for (const MaterialPoints<D>& points : {material_points(model), resting_points(model)})
    for (const Run& run : points.runs)
    {
      const double h = smallest_altitude<D>(model.mesh.shapes[run.cell]);
      const Law& law = points.laws[static_cast<std::size_t>(run.material)];
      const bool differs = has_moduli_of_points(law);
      double modulus = p_wave_modulus(law);
      for (Index p = run.first; p < run.last; ++p)
      {
        if (differs)
          modulus = limiting_modulus_of_particle(law, points.particles, p);
        const double squared = h * h / speed_squared(p, modulus);
        if (squared < found.squared_time)
          found = {p, h, squared};
      }
    }
  return found;
}

/// Root of the least of the ranks' values.
/// @note Collective
double root_of_least(double squared, MPI_Comm comm)
{
  MPI_Allreduce(MPI_IN_PLACE, &squared, 1, MPI_DOUBLE, MPI_MIN, comm);
  return std::sqrt(squared);
}
} // namespace

template <class G>
CriticalParticle critical_particle(const Model<G>& model)
{
  return particle_of_shortest_time(model, [&](Index p, double modulus) { return wave_squared(model, p, modulus); });
}

template <class G>
double critical_time_step(const Model<G>& model)
{
  return root_of_least(critical_particle(model).squared_time, model.exchange.comm);
}

double critical_with_members(double critical, double squared_frequency)
{
  return 1 / std::sqrt(1 / (critical * critical) + squared_frequency / 4);
}

template <class G>
double critical_time_step_of_soil(const Model<G>& model)
{
  const auto speed_squared = [&](Index p, double modulus) { return wave_of_soil_squared(model, p, modulus); };
  return root_of_least(particle_of_shortest_time(model, speed_squared).squared_time, model.exchange.comm);
}

#define INSTANTIATE(G)                                                                                                 \
  template CriticalParticle critical_particle(const Model<G>&);                                                        \
  template double critical_time_step(const Model<G>&);                                                                 \
  template double critical_time_step_of_soil(const Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
