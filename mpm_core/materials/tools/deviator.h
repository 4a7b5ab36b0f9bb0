#pragma once
/// @file
/// Mean and deviator of a stress, and the tangents of laws that are written in them.

#include "base/types.h"

#include <algorithm>
#include <cmath>

namespace mpm::materials
{
template <int D, class T = double>
T mean(const std::array<T, n_stress<D>>& stress)
{
  return (stress[0] + stress[1] + stress[2]) / 3;
}

template <int D, class T = double>
std::array<T, n_stress<D>> deviator(std::array<T, n_stress<D>> stress)
{
  const T p = mean<D>(stress);
  for (std::size_t k = 0; k < 3; ++k)
    stress[k] -= p;
  return stress;
}

/// sqrt(J2) of a deviator
template <int D>
double radius(const SymTensor<D>& s)
{
  double j2 = 0.5 * (s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
  for (std::size_t k = 3; k < n_stress<D>; ++k)
    j2 += s[k] * s[k];
  return std::sqrt(j2);
}

/// Full contraction of two tensors
template <int D, class T = double>
T product(const std::array<T, n_stress<D>>& a, const std::array<T, n_stress<D>>& b)
{
  T shear = a[3] * b[3];
  for (std::size_t k = 4; k < n_stress<D>; ++k)
    shear += a[k] * b[k];
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2 * shear;
}

/// The mean p and the factor r of the deviator s of a new stress p 1 + r s depend on the strain increment through the
/// volumetric strain and through sqrt(J2) of s, whose derivative by the strain is shear * s / sqrt(J2)
struct DeviatoricDerivatives
{
  double mean_by_volume;  ///< dp / d volumetric strain
  double mean_by_radius;  ///< dp / d sqrt(J2)
  double ratio_by_volume; ///< dr / d volumetric strain
  double ratio_by_radius; ///< dr / d sqrt(J2)
};

/// Writes the tangent of p 1 + r s, where s grows by twice the shear modulus times the deviatoric strain.
template <int D>
void write_deviatoric_tangent(const SymTensor<D>& s, double ratio, double shear, const DeviatoricDerivatives& d,
                              double* tangent)
{
  constexpr std::size_t n = n_stress<D>;
  const double size = radius<D>(s);
  const double per_radius = size > 0 ? shear / size : 0.0;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
    {
      const double volume = j < 3 ? 1.0 : 0.0;
      const double by_radius = per_radius * s[j];
      double entry = s[i] * (d.ratio_by_volume * volume + d.ratio_by_radius * by_radius);
      if (i < 3)
        entry += d.mean_by_volume * volume + d.mean_by_radius * by_radius - (j < 3 ? 2 * ratio * shear / 3 : 0.0);
      if (i == j)
        entry += i < 3 ? 2 * ratio * shear : ratio * shear;
      tangent[i * n + j] = entry;
    }
}
} // namespace mpm::materials
