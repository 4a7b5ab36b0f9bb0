#include "implicit/tangent.h"

namespace mpm
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

/// Adds what the turn of the stress changes in the tangent of a cell.
///
/// A law that knows no directions gives sigma(R s R^T, e) = R sigma(s, R^T e R) R^T for the start's stress s. So when R
/// turns by Omega while the strain e stays, sigma changes by Omega sigma - sigma Omega - C : (Omega e - e Omega).
template <int D>
void add_spin(const std::array<Symmetric<D>, n_symmetric<D>>& c, const Symmetric<D>& stress,
              const CellStrain<D>& strain, CellTangent<D>& tangent)
{
  Symmetric<D> e; // as a tensor
  for (int k = 0; k < n_symmetric<D>; ++k)
    e[k] = strain.increment[stress_component<D>[k]] * (k < D ? 1.0 : 0.5);
  const auto spin = spins<D>(strain.rotation);
  for (std::size_t s = 0; s < spin.size(); ++s)
  {
    const Symmetric<D> stress_turned = turned_by<D>(spin[s], stress), strain_turned = turned_by<D>(spin[s], e);
    const auto [b, m] = spin_pairs<D>[s];
    for (int k = 0; k < n_symmetric<D>; ++k)
    {
      double change = stress_turned[k];
      for (int j = 0; j < n_symmetric<D>; ++j)
        change -= c[k][j] * strain_turned[j] * (j < D ? 1.0 : 2.0);
      tangent.by_gradient[k][b * D + m] += change;
      tangent.by_gradient[k][m * D + b] -= change;
    }
  }
}

/// Splits the mean of the normal components in the plane off a column of the tangent.
template <int D>
double split_mean(std::array<double*, D> normal)
{
  double mean = 0;
  for (const double* component : normal)
    mean += *component / D;
  for (double* component : normal)
    *component -= mean;
  return mean;
}

/// Volumetric strains are averaged: they count by themselves, not in the gradient.
template <int D>
void split_volumetric(const std::array<Symmetric<D>, n_symmetric<D>>& c, CellTangent<D>& tangent)
{
  for (int k = 0; k < n_symmetric<D>; ++k)
  {
    for (int j = 0; j < D; ++j)
      tangent.by_volumetric[k] += c[k][j] / D;
    for (int j = 0; j < D; ++j)
      tangent.by_gradient[k][j * D + j] -= tangent.by_volumetric[k];
  }
}

/// So do mean stresses.
template <int D>
void split_mean_stress(CellTangent<D>& tangent)
{
  std::array<double*, D> normal;
  for (int m = 0; m < D * D; ++m)
  {
    for (int k = 0; k < D; ++k)
      normal[k] = &tangent.by_gradient[k][m];
    tangent.mean_by_gradient[m] = split_mean<D>(normal);
  }
  for (int k = 0; k < D; ++k)
    normal[k] = &tangent.by_volumetric[k];
  tangent.mean_by_volumetric = split_mean<D>(normal);
}
} // namespace

template <int D>
CellTangent<D> cell_tangent(const std::array<Symmetric<D>, n_symmetric<D>>& c, const Symmetric<D>& stress,
                            const CellStrain<D>& strain, const ImplicitOptions& options)
{
  CellTangent<D> tangent{};
  for (int k = 0; k < n_symmetric<D>; ++k)
    for (int b = 0; b < D; ++b)
      for (int m = 0; m < D; ++m)
        tangent.by_gradient[k][b * D + m] = c[k][symmetric_index<D>(b, m)];
  if (!options.hold_positions)
    add_spin<D>(c, stress, strain, tangent);
  if (options.mixed_discretisation)
    split_volumetric<D>(c, tangent);
  if (options.average_stress)
    split_mean_stress<D>(tangent);
  return tangent;
}

#define INSTANTIATE(D)                                                                                                 \
  template CellTangent<D> cell_tangent<D>(const std::array<Symmetric<D>, n_symmetric<D>>&, const Symmetric<D>&,        \
                                          const CellStrain<D>&, const ImplicitOptions&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
