#pragma once
/// @file
/// Elastic moduli of single points, which differ from those of their law where the stiffness depends on pressure or
/// place.

#include "materials/laws/law.h"

#include <span>

namespace mpm::materials
{
/// Moduli of compression and shear waves [Pa]
struct WaveModuli
{
  double p_wave, shear;
};

/// Whether points of a law may have other moduli than those of its numbers.
bool has_moduli_of_points(const Law& law);

/// Moduli of a point as it is now: of `CamClay`, `NorSand` and `Sanisand` at its pressure, of `HardeningSoil` with that
/// as the smallest principal stress, which bounds them, of `Heterogeneous` by its own parameters.
/// @param mean_stress  [Pa], tension positive
/// @param state        the law's state variables
WaveModuli moduli_of_point(const Law& law, double mean_stress, std::span<const double> state);

/// Modulus of the compression wave [Pa] from which a point's time step follows: of `CamClay` that at twice the point's
/// preconsolidation pressure, of `NorSand` that at twice the largest pressure within the yield surface, of `Sanisand`
/// that at twice its pressure, or at the law's largest one where that is more, of `HardeningSoil` that at twice its
/// pressure, otherwise that of the law's numbers, which bounds those of all points.
double limiting_modulus(const Law& law, double mean_stress, std::span<const double> state);
} // namespace mpm::materials
