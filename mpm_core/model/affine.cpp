#include "model/affine.h"

#include "base/eigen.h"

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

template <class G>
void begin_transfer(Model<G>& model, Transfer transfer)
{
  constexpr int D = G::dim;
  auto& gradients = model.particles.velocity_gradient;
  const bool affine = transfer == Transfer::affine;
  if (model.particles.resting.present || gradients.present == affine) // resting cells have gradients in any run
    return;
  if (!affine)
    gradients = {};
  else
  {
    prepare(model);
    require(gradients, model.particles.id.size());
    for (const Run& run : model.order.runs)
    {
      const Matrix<D> gradient = fitted_gradient<G>(field_of(model, run.material).moments[run.cell]);
      for (int k = 0; k < D * D; ++k)
        std::fill(gradients[k].begin() + run.first, gradients[k].begin() + run.last, gradient[k / D][k % D]);
    }
  }
  model.ready = false; // the moments have the gradients in them
}

#define INSTANTIATE(G) template void begin_transfer(Model<G>&, Transfer);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
