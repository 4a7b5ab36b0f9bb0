#include "model/energy.h"

#include "materials/laws/stored_energy.h"
#include "model/affine.h"
#include "model/model.h"
#include "transfer/resting.h"

#include <algorithm>
#include <cmath>

namespace mpm::model
{
namespace
{
/// Kinetic energy of a particle, or of all particles that a resting cell replaces.
template <class G, int D = G::dim>
double kinetic_energy(const Model<G>& model, Index p)
{
  const Particles<D>& particles = model.particles;
  const Vector<D> v = at<D>(particles.velocity, p);
  if (!is_resting(particles, p))
    return 0.5 * particles.mass[p] * dot<D>(v, v);
  const CellMoments<G>& moments = field_of(model, particles.material[p]).moments[particles.cell[p]];
  const Matrix<D> gradient = gradient_at<D>(particles.velocity_gradient, p);
  double twice = 0;
  for (int a = 0; a < D; ++a)
    twice += sum_of_products<G>({v[a], gradient[a]}, {v[a], gradient[a]}, moments);
  return 0.5 * twice;
}
} // namespace

template <class G, int D>
Vector<G::dim> particle_momentum(const Model<G, D>& model, Index p)
{
  const Particles<D>& particles = model.particles;
  Vector<D> momentum = at<D>(particles.velocity, p);
  for (double& component : momentum)
    component *= particles.mass[p];
  if (!is_resting(particles, p))
    return momentum;
  const CellMoments<G>& moments = field_of(model, particles.material[p]).moments[particles.cell[p]];
  const Matrix<D> gradient = gradient_at<D>(particles.velocity_gradient, p);
  for (int a = 0; a < D; ++a)
    momentum[a] += dot<D>(gradient[a], moments.mass_xi);
  return momentum;
}

template <class G, int D>
ParticleEnergy particle_energy(const Model<G, D>& model, Index p)
{
  const Particles<D>& particles = model.particles;
  SymTensor<D> stress;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    stress[k] = particles.stress[k][p];
  std::array<double, max_states> state{};
  for (std::size_t k = 0; k < particles.state.size(); ++k)
    state[k] = particles.state[k][p];
  double kinetic = kinetic_energy(model, p);
  double of_water = 0;
  if (particles.water_velocity.present)
  {
    const Vector<D> w = at<D>(particles.water_velocity.columns, p);
    kinetic += 0.5 * particles.water_mass[0][p] * dot<D>(w, w);
    if (is_resting(particles, p))
    {
      const CellMoments<G>& moments = field_of(model, particles.material[p]).moments[particles.cell[p]];
      const Matrix<D> gradient = gradient_at<D>(particles.water_gradient, p);
      for (const Vector<D>& row : gradient) // masses of soil and water are in the same proportions
        kinetic += 0.5 * particles.water_mass[0][p] / moments.mass * relative_product<D>(row, row, moments.mass_xixi);
    }
  }
  if (model.water && particles.pore_pressure.present)
  {
    double squared = std::pow(particles.pore_pressure[0][p], 2);
    if (is_resting(particles, p) && particles.pressure_gradient.present)
    {
      const AffineScalar<D> pressure{particles.pore_pressure[0][p], at<D>(particles.pressure_gradient.columns, p)};
      const CellMoments<G>& moments = field_of(model, particles.material[p]).moments[particles.cell[p]];
      squared = sum_of_products<G>(pressure, pressure, moments) / moments.mass;
    }
    of_water = 0.5 * particles.volume[p] * particles.porosity[0][p] * squared / model.water->modulus;
  }
  return {kinetic,
          of_water + particles.volume[p] * stored_energy<D>(model.laws[particles.material[p]], stress, state.data())};
}

template <class G, int D>
ParticleEnergy particle_energy(const Model<G, D>& model)
{
  ParticleEnergy sum{0, 0};
  for (Index p = 0; p < model.particles.size(); ++p)
  {
    const ParticleEnergy energy = particle_energy(model, p);
    sum.kinetic += energy.kinetic;
    sum.stored += energy.stored;
  }
  if (has_affine_gradients(model.particles))
    sum.kinetic = model.energy.kinetic;
  return sum;
}

template <class G, int D>
double energy_balance(const Model<G, D>& model, double kinetic)
{
  const Totals& totals = model.totals;
  const EnergyBook& book = model.energy;
  return totals.external_work + totals.support_work - totals.damping_work - totals.drag_work - totals.friction_work -
         (book.stress_work - book.ahead) - book.pic_loss - kinetic - book.outflow_kinetic;
}

template <class G, int D>
std::array<double, 2> works_so_far(const Model<G, D>& model)
{
  return {model.totals.external_work + model.totals.support_work - model.energy.external_start,
          model.energy.stress_work - model.energy.stress_start};
}

template <class G, int D>
void note_largest_work(Model<G, D>& model)
{
  std::array<double, 2> works = works_so_far(model);
  MPI_Allreduce(MPI_IN_PLACE, works.data(), 2, MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  for (double work : works)
    model.energy.largest_work = std::max(model.energy.largest_work, std::abs(work));
}

template <class G, int D>
void start_energy_balance(Model<G, D>& model)
{
  EnergyBook& book = model.energy;
  const ParticleEnergy energy = particle_energy(model);
  book.ahead = 0;
  book.kinetic_start = energy.kinetic;
  book.balance_start = energy_balance(model, energy.kinetic);
  book.external_start = model.totals.external_work + model.totals.support_work;
  book.stress_start = book.stress_work;
  book.pic_start = book.pic_loss;
  book.largest_work = 0;
  book.stale = false;
}

template <class G, int D>
void start_plastic_work(Model<G, D>& model)
{
  EnergyBook& book = model.energy;
  book.plastic_start = book.stress_work - particle_energy(model).stored - book.outflow_stored;
}

#define INSTANTIATE(G)                                                                                                 \
  template Vector<G::dim> particle_momentum(const Model<G>&, Index);                                                   \
  template ParticleEnergy particle_energy(const Model<G>&, Index);                                                     \
  template ParticleEnergy particle_energy(const Model<G>&);                                                            \
  template double energy_balance(const Model<G>&, double);                                                             \
  template std::array<double, 2> works_so_far(const Model<G>&);                                                        \
  template void note_largest_work(Model<G>&);                                                                          \
  template void start_energy_balance(Model<G>&);                                                                       \
  template void start_plastic_work(Model<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
