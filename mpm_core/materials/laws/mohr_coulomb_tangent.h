#pragma once
/// @file
/// Tangent of the Mohr-Coulomb law, consistent with the return.

#include "materials/tools/spectral.h"

namespace mpm::materials::mohr_coulomb
{
using Matrix3 = std::array<std::array<double, 3>, 3>;

/// For each region the derivative of the returned principal stresses by the trial ones. They are constants of the
/// material, as each return is linear.
struct RegionMaps
{
  std::array<Matrix3, n_regions> of;
};

RegionMaps region_maps(const Surface& m);

/// That of one region
Matrix3 region_map(const Surface& m, Region region);

/// Writes d stress / d strain (row-major, engineering shear) of a point that was returned from the trial stress given.
/// @param map  derivative of the returned principal stresses by the trial ones
template <int D>
void write_tangent(const Surface& m, const Matrix3& map, const Spectral<D>& trial, const Returned& returned,
                   double* tangent);
} // namespace mpm::materials::mohr_coulomb
