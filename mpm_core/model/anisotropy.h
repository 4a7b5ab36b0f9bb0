#pragma once
/// @file
/// Conductivities that depend on the direction.

#include "model/pore_water.h"

namespace mpm::model
{
/// Conductivity of the soil of a law over that of its particles, and its principal values.
template <int D>
struct Anisotropy
{
  Matrix<D> tensor; ///< symmetric, positive [-]
  double least, largest;
};

template <int D>
Anisotropy<D> anisotropy_of(const PoreWater& water, Index material);

/// The inverse: resistance of the soil of a law to flow over that of isotropic soil.
template <int D>
Matrix<D> resistance_of(const PoreWater& water, Index material);
} // namespace mpm::model
