#include "model/affine.h"

#include "base/eigen.h"
#include "model/energy.h"
#include "transfer/nodes.h"

#include <algorithm>
#include <cmath>

namespace mpm::model
{
namespace
{
/// The particles of a cell are in a row where the determinant of their second moments is below this part of the largest
/// that their trace allows.
constexpr double least_moment = 1e-3;

/// The second moments of a cell's particles about their centre are round-off where they are below this part of those
/// about the centre of the cell: it has one particle, or several at one point.
constexpr double least_spread = 1e-8;

/// Terms of the series of the inverse mass matrix, M^-1 = M_l^-1 sum_k (1 - M M_l^-1)^k. A wave whose energy in M is
/// the fraction c of that in M_l has the sum of (1 - c)^k, 1 / c: c is 0.9, 0.7 and 0.5 for waves of 8, 4 and 3 cells,
/// and not below 1 / (D + 2) in full cells, so that less than 0.01 and 0.03 of any wave are left out in two and three
/// dimensions. Nodes beside a single particle have little mass, c is nearly zero, and no force changes their velocity
/// against its.
constexpr int inertia_terms = 16;

/// The gradient of the velocities of a cell's particles by least squares, weighted by mass.
template <class G, int D = G::dim>
Matrix<D> fitted_gradient(const CellMoments<G>& moments)
{
  using Square = Eigen::Matrix<double, D, D>;
  Square second, product;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
    {
      second(i, j) =
          moments.mass_xixi[symmetric_index<D>(i, j)] - moments.mass_xi[i] * moments.mass_xi[j] / moments.mass;
      product(i, j) = moments.momentum_xi[i][j] - moments.momentum[i] * moments.mass_xi[j] / moments.mass;
    }
  double about_cell = 0;
  for (int i = 0; i < D; ++i)
    about_cell += moments.mass_xixi[symmetric_index<D>(i, i)];
  const double spread = second.trace();
  if (!(spread > least_spread * about_cell && second.determinant() > least_moment * std::pow(spread / D, D)))
    return {};
  const Square found = product * second.inverse();
  Matrix<D> gradient;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      gradient[i][j] = found(i, j);
  return gradient;
}
} // namespace

namespace
{
/// See `affine_kinetic_energy`, of the particles of a velocity field.
template <class G, int D = G::dim>
double affine_kinetic_energy(const Mesh<D>& mesh, NodeExchange& exchange, const VelocityField<G>& field)
{
  std::vector<double> mass(mesh.points.size());
  std::vector<Vector<D>> momentum(mass.size()), velocity(mass.size()), taken(mass.size());
  for (Index c : field.part.cells)
    for (int k = 0; k <= D; ++k)
    {
      const CellMoments<G>& moments = field.moments[c];
      const Vector<D>& gradient = mesh.shapes[c].gradient[k];
      const Index node = mesh.cells[c][k];
      mass[node] += at_vertex<D>(moments.mass, moments.mass_xi, gradient);
      for (int a = 0; a < D; ++a)
        momentum[node][a] += at_vertex<D>(moments.momentum[a], moments.momentum_xi[a], gradient);
    }
  sum_shared(exchange, mass);
  sum_shared(exchange, momentum);
  const auto per_mass = [&](Index i) { return mass[i] > field.least_mass ? 1 / mass[i] : 0; };
  const auto hold = [&] // at supports, where no force changes the velocity
  {
    for (Support<D> held : field.supports)
    {
      held.value = {};
      impose<D>(held, velocity[held.node]);
    }
  };
  double twice = 0;
  const auto add_term = [&]
  {
    for (Index i : field.part.nodes)
      if (exchange.owned[i])
        twice += dot<D>(momentum[i], velocity[i]);
  };
  for (Index i : field.part.nodes)
    for (int a = 0; a < D; ++a)
      velocity[i][a] = momentum[i][a] * per_mass(i);
  add_term();
  hold();
  for (int term = 1; term < inertia_terms; ++term)
  {
    scatter_momentum<G>(mesh, exchange, field.part, field.moments, velocity, taken);
    sum_shared(exchange, taken);
    for (Index i : field.part.nodes)
      for (int a = 0; a < D; ++a)
        velocity[i][a] -= taken[i][a] * per_mass(i);
    hold();
    add_term();
  }
  return 0.5 * twice;
}
} // namespace

template <class G>
double affine_kinetic_energy(Model<G>& model)
{
  double sum = 0;
  for (const VelocityField<G>& field : model.fields)
    sum += affine_kinetic_energy(model.mesh, model.exchange, field);
  return sum;
}

template <class G>
void begin_transfer(Model<G>& model, Transfer transfer)
{
  constexpr int D = G::dim;
  auto& gradients = model.particles.velocity_gradient;
  const bool affine = transfer == Transfer::affine;
  if (model.particles.resting.present || gradients.present == affine) // resting cells have gradients in any run
    return;
  prepare(model);
  const double before = particle_energy(model).kinetic;
  if (!affine)
    gradients = {};
  else
  {
    require(gradients, model.particles.id.size());
    for (const Run& run : model.order.runs)
    {
      const Matrix<D> gradient = fitted_gradient<G>(field_of(model, run.material).moments[run.cell]);
      for (int k = 0; k < D * D; ++k)
        std::fill(gradients[k].begin() + run.first, gradients[k].begin() + run.last, gradient[k / D][k % D]);
    }
  }
  model.ready = false; // the moments have the gradients in them
  prepare(model);
  const double gained = particle_energy(model).kinetic - before;
  if (!affine)
    model.energy.pic_loss -= gained;
  else
  {
    model.energy.balance_start -= gained;
    model.energy.kinetic_start += gained;
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template double affine_kinetic_energy(Model<G>&);                                                                    \
  template void begin_transfer(Model<G>&, Transfer);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
