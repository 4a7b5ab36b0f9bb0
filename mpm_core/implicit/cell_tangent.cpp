#include "implicit/cell_tangent.h"

namespace mpm::implicit
{
namespace
{
template <int D>
constexpr std::array<std::array<int, 2>, D*(D - 1) / 2> spin_pairs = []
{
  std::array<std::array<int, 2>, D*(D - 1) / 2> pairs{};
  for (int b = 0, k = 0; b < D; ++b)
    for (int m = b + 1; m < D; ++m)
      pairs[k++] = {b, m};
  return pairs;
}();

/// d Omega = dR R^T for each pair b < m of axes, per du_b/dx_m; its negative belongs to du_m/dx_b. The Cayley transform
/// R of the half spin W has dR R^T = 2 Y dW Y^T with Y = (1 - W)^-1 = (1 + R) / 2.
template <int D>
std::array<Matrix<D>, D*(D - 1) / 2> spins(const Matrix<D>& rotation)
{
  Matrix<D> y = rotation;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      y[i][j] = 0.5 * (y[i][j] + (i == j ? 1.0 : 0.0));
  std::array<Matrix<D>, D*(D - 1) / 2> spin;
  for (std::size_t k = 0; k < spin.size(); ++k)
  {
    const auto [b, m] = spin_pairs<D>[k];
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        spin[k][i][j] = 0.5 * (y[i][b] * y[j][m] - y[i][m] * y[j][b]);
  }
  return spin;
}

template <int D>
using Symmetric = std::array<double, n_symmetric<D>>;

/// Omega S - S Omega of a symmetric S.
template <int D>
Symmetric<D> turned_by(const Matrix<D>& omega, const Symmetric<D>& s)
{
  Matrix<D> product{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k)
        product[i][j] += omega[i][k] * s[symmetric_index<D>(k, j)];
  Symmetric<D> turned;
  for (int k = 0; k < n_symmetric<D>; ++k)
  {
    const auto [i, j] = symmetric_pairs<D>[k];
    turned[k] = product[i][j] + product[j][i]; // -S Omega is the transpose of Omega S
  }
  return turned;
}

/// Adds what the rotation of the stress changes in the tangent of a cell.
///
/// A law that knows no directions gives sigma(R s R^T, e) = R sigma(s, R^T e R) R^T for the start's stress s. So when R
/// turns by Omega while the strain e stays, sigma changes by Omega sigma - sigma Omega - C : (Omega e - e Omega). The
/// hoop stays what it is.
template <class G, int D = G::dim>
void add_spin(const std::array<Working<G>, G::n_working>& c, const Working<G>& stress, const CellStrain<D>& strain,
              CellTangent<G>& tangent)
{
  Symmetric<D> e, s; // as a tensor; without the hoop
  for (int k = 0; k < n_symmetric<D>; ++k)
  {
    e[k] = strain.increment[stress_component<D>[k]] * (k < D ? 1.0 : 0.5);
    s[k] = stress[k];
  }
  const auto spin = spins<D>(strain.rotation);
  for (std::size_t axis = 0; axis < spin.size(); ++axis)
  {
    const Symmetric<D> stress_turned = turned_by<D>(spin[axis], s), strain_turned = turned_by<D>(spin[axis], e);
    const auto [b, m] = spin_pairs<D>[axis];
    for (int k = 0; k < G::n_working; ++k)
    {
      double change = k < n_symmetric<D> ? stress_turned[k] : 0;
      for (int j = 0; j < n_symmetric<D>; ++j)
        change -= c[k][j] * strain_turned[j] * (j < D ? 1.0 : 2.0);
      tangent.by_gradient[k][b * D + m] += change;
      tangent.by_gradient[k][m * D + b] -= change;
    }
  }
}

/// Entry of the gradient that is the normal strain along axis a; the one after the last axis is the hoop.
template <class G>
constexpr int normal_entry(int a)
{
  return a < G::dim ? a * G::dim + a : G::dim * G::dim;
}

/// Splits the averaged part of the mean of the normal components off a column of the tangent.
template <class G>
double split_mean(std::array<double*, G::n_normal> normal, double averaged)
{
  double mean = 0;
  for (const double* component : normal)
    mean += averaged * *component / G::n_normal;
  for (double* component : normal)
    *component -= mean;
  return mean;
}

/// Volumetric strains are averaged: that fraction counts by itself, not in the gradient.
template <class G>
void split_volumetric(const std::array<Working<G>, G::n_working>& c, double averaged, CellTangent<G>& tangent)
{
  for (int k = 0; k < G::n_working; ++k)
  {
    for (int j : normal_component<G>)
      tangent.by_volumetric[k] += averaged * c[k][j] / G::n_normal;
    for (int a = 0; a < G::n_normal; ++a)
      tangent.by_gradient[k][normal_entry<G>(a)] -= tangent.by_volumetric[k];
  }
}

/// So do mean stresses.
template <class G>
void split_mean_stress(double averaged, CellTangent<G>& tangent)
{
  std::array<double*, G::n_normal> normal;
  for (int m = 0; m < n_gradient<G>; ++m)
  {
    for (int a = 0; a < G::n_normal; ++a)
      normal[a] = &tangent.by_gradient[normal_component<G>[a]][m];
    tangent.mean_by_gradient[m] = split_mean<G>(normal, averaged);
  }
  for (int a = 0; a < G::n_normal; ++a)
    normal[a] = &tangent.by_volumetric[normal_component<G>[a]];
  tangent.mean_by_volumetric = split_mean<G>(normal, averaged);
}
} // namespace

template <class G, int D>
CellTangent<G> cell_tangent(const std::array<Working<G>, G::n_working>& c, const Working<G>& stress,
                            const CellStrain<D>& strain, const ImplicitOptions& options, double averaged_strain,
                            double averaged_force)
{
  CellTangent<G> tangent{};
  for (int k = 0; k < G::n_working; ++k)
  {
    for (int b = 0; b < D; ++b)
      for (int m = 0; m < D; ++m)
        tangent.by_gradient[k][b * D + m] = c[k][symmetric_index<D>(b, m)];
    if constexpr (G::has_hoop)
      tangent.by_gradient[k][D * D] = c[k][n_symmetric<D>];
  }
  if (!options.hold_positions)
    add_spin(c, stress, strain, tangent);
  if (options.nmd)
    split_volumetric(c, averaged_strain, tangent);
  if (options.average_stress)
    split_mean_stress(averaged_force, tangent);
  return tangent;
}

#define INSTANTIATE(G)                                                                                                 \
  template CellTangent<G> cell_tangent(const std::array<Working<G>, G::n_working>&, const Working<G>&,                 \
                                       const CellStrain<G::dim>&, const ImplicitOptions&, double, double);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
