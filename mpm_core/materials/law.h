#pragma once
/// @file
/// The list of laws. A new law is one file beside the others and one entry here.

#include "materials/linear_elastic.h"
#include "materials/mohr_coulomb.h"

#include <variant>

namespace mpm
{
/// Any constitutive law, as a plain value
using Law = std::variant<LinearElastic, MohrCoulomb>;

/// Number of state variables of a law
inline int n_state(const Law& law)
{
  return std::visit([](const auto& l) { return std::decay_t<decltype(l)>::n_state; }, law);
}

inline void check(const Law& law)
{
  std::visit([](const auto& l) { check(l); }, law);
}

inline double p_wave_modulus(const Law& law)
{
  return std::visit([](const auto& l) { return p_wave_modulus(l); }, law);
}

template <int D>
BatchReport update(const Law& law, const PointBatch<D>& points)
{
  return std::visit([&](const auto& l) { return update<D>(l, points); }, law);
}
} // namespace mpm
