#pragma once
/// @file
/// The energy that a point's elastic strain stores, by its stress and state.

#include "materials/laws/law.h"

namespace mpm::materials
{
/// Stored energy of a point per present volume [J/m3], from its Cauchy stress [Pa] and its state variables.
///
/// Laws with constant elastic moduli: sigma : C^-1 : sigma / 2; Hencky: the same of the Kirchhoff stress, over J;
/// undrained: that of the skeleton's effective stress and of the excess pore pressure in the water; modified Cam-Clay,
/// NorSand and SANISAND: the integral along a swelling line, and q^2 / (6 G). A rate law in the Cauchy stress gives it
/// back up to the order of the elastic strains.
/// @returns NaN for laws that do not say what they store: those written in Python, and UMATs
template <int D>
double stored_energy(const Law& law, const SymTensor<D>& stress, const double* state);
} // namespace mpm::materials
