#pragma once
/// @file
/// The Lode angle of a deviator, by the cosine of its threefold.

#include "materials/tools/deviator.h"

namespace mpm::materials
{
template <int D>
double determinant(const SymTensor<D>& s)
{
  const double in_plane = s[0] * s[1] - s[3] * s[3];
  if constexpr (D == 2)
    return in_plane * s[2];
  else
    return in_plane * s[2] + 2 * s[3] * s[4] * s[5] - s[0] * s[4] * s[4] - s[1] * s[5] * s[5];
}

/// The square s s of a tensor
template <int D>
SymTensor<D> square(const SymTensor<D>& s)
{
  const double xy = s[3] * s[3];
  if constexpr (D == 2)
    return {s[0] * s[0] + xy, s[1] * s[1] + xy, s[2] * s[2], (s[0] + s[1]) * s[3]};
  else
  {
    const double yz = s[4] * s[4], xz = s[5] * s[5];
    return {s[0] * s[0] + xy + xz,
            s[1] * s[1] + xy + yz,
            s[2] * s[2] + yz + xz,
            (s[0] + s[1]) * s[3] + s[4] * s[5],
            (s[1] + s[2]) * s[4] + s[3] * s[5],
            (s[0] + s[2]) * s[5] + s[3] * s[4]};
  }
}

/// cos(3 theta) of a deviator with q = sqrt(3 J2): 1 in triaxial compression, -1 in triaxial extension, 0 where one of
/// the principal stresses is their mean. Where there is no direction, q^3 = 0, it is 1.
template <int D>
double lode_cosine(const SymTensor<D>& deviator, double q)
{
  const double cube = q * q * q;
  return cube > 0 ? std::clamp(-13.5 * determinant<D>(deviator) / cube, -1.0, 1.0) : 1;
}

/// Its derivative by the deviator, itself a deviator; zero where there is no direction
template <int D>
SymTensor<D> lode_cosine_slope(const SymTensor<D>& deviator, double q, double cosine)
{
  if (!(q * q * q > 0))
    return {};
  const double scale = 1 / q;
  SymTensor<D> slope = square<D>(deviator);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    slope[k] = -(13.5 * (slope[k] * scale - (k < 3 ? 2 * q / 9 : 0.0)) + 4.5 * cosine * deviator[k]) * scale * scale;
  return slope;
}
} // namespace mpm::materials
