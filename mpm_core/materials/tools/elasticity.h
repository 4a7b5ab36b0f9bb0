#pragma once
/// @file
/// Isotropic linear elasticity, shared by the laws.

#include "materials/laws/batch.h"

namespace mpm::materials
{
/// Lame's constants [Pa]
struct ElasticModuli
{
  double lambda;
  double shear;
};

/// Lame's constants from Young's modulus [Pa] and Poisson's ratio [-]
constexpr ElasticModuli elastic_moduli(double young, double poisson)
{
  return {young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))};
}

/// K = lambda + 2 mu / 3 [Pa]
constexpr double bulk_modulus(const ElasticModuli& moduli) { return moduli.lambda + 2 * moduli.shear / 3; }

/// K + 4G/3 = lambda + 2 mu [Pa]
constexpr double p_wave_modulus(const ElasticModuli& moduli) { return moduli.lambda + 2 * moduli.shear; }

/// Tangent d stress / d strain (engineering shear), row-major
template <int D>
std::array<double, n_stress<D> * n_stress<D>> elastic_tangent(const ElasticModuli& moduli)
{
  constexpr int components = n_stress<D>;
  std::array<double, components * components> tangent{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      tangent[static_cast<std::size_t>(i * components + j)] = moduli.lambda + (i == j ? 2 * moduli.shear : 0.0);
  for (int i = 3; i < components; ++i)
    tangent[static_cast<std::size_t>(i * (components + 1))] = moduli.shear;
  return tangent;
}

/// Writes the elastic tangent of all points of a batch.
template <int D>
void fill_elastic_tangent(const ElasticModuli& moduli, Index size, double* tangent)
{
  const auto elastic = elastic_tangent<D>(moduli);
  for (Index i = 0; i < size; ++i)
    for (std::size_t k = 0; k < elastic.size(); ++k)
      tangent[static_cast<std::size_t>(i) * elastic.size() + k] = elastic[k];
}

/// Stress of a point after an elastic increment
template <int D>
inline SymTensor<D> elastic_trial(const ElasticModuli& moduli, const PointBatch<D>& points, Index i)
{
  const auto& strain = points.strain_increment;
  const auto& stress = points.stress;
  const double volumetric = moduli.lambda * (strain[0][i] + strain[1][i] + strain[2][i]);
  const double twice_shear = 2 * moduli.shear;
  SymTensor<D> trial;
  trial[0] = stress[0][i] + (volumetric + twice_shear * strain[0][i]);
  trial[1] = stress[1][i] + (volumetric + twice_shear * strain[1][i]);
  trial[2] = stress[2][i] + (volumetric + twice_shear * strain[2][i]);
  trial[3] = stress[3][i] + moduli.shear * strain[3][i];
  if constexpr (D == 3)
  {
    trial[4] = stress[4][i] + moduli.shear * strain[4][i];
    trial[5] = stress[5][i] + moduli.shear * strain[5][i];
  }
  return trial;
}

/// Whether a stress can be worked with: no component is NaN or infinite, nor overflows when it is squared
template <int D>
inline bool is_usable(const SymTensor<D>& stress)
{
  double squares = stress[0] * stress[0] + stress[1] * stress[1] + stress[2] * stress[2] + stress[3] * stress[3];
  if constexpr (D == 3)
    squares += stress[4] * stress[4] + stress[5] * stress[5];
  return squares - squares == 0;
}

/// The points of a batch whose trial stress is not usable. An update leaves the stress of such a point as it was, so
/// this may be asked afterwards.
template <int D>
std::vector<Index> unusable_points(const ElasticModuli& moduli, const PointBatch<D>& points)
{
  std::vector<Index> unusable;
  for (Index i = 0; i < points.size; ++i)
    if (!is_usable<D>(elastic_trial<D>(moduli, points, i)))
      unusable.push_back(i);
  return unusable;
}
} // namespace mpm::materials
