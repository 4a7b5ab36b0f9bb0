#pragma once
/// @file
/// The explicit step of saturated soil whose water has a velocity of its own.

#include "explicit/explicit_step.h"

namespace mpm::explicit_scheme
{
/// One step of length dt [s] of the equations in model/water_mapping.h; otherwise as `explicit_step`, which calls it.
/// @pre has_two_phases(model)
/// @note Collective
template <class G>
void two_phase_step(Model<G>& model, const ExplicitOptions& options, double dt);

/// Square of the speed of the fast compression wave of soil and water without drag [m2/s2], which none exceeds with it:
/// the larger root c^2 of det(K - c^2 M) = 0, K = [E + (1-n)^2 K_w/n, (1-n) K_w; ., n K_w], M = diag(m_s, m_w) / V.
/// @param modulus  E of the soil, drained [Pa]
/// @param soil, water  masses per volume [kg/m3]
double fast_wave_squared(double modulus, double water_modulus, double porosity, double soil, double water);
} // namespace mpm::explicit_scheme
