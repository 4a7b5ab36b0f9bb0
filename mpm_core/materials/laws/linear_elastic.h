#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// Isotropic linear elasticity, in rate form between Cauchy stress and strain increment.
struct LinearElastic
{
  double young, poisson;

  static constexpr auto parameters()
  {
    using L = LinearElastic;
    return std::array{young_parameter<L>(entry<&L::young>), poisson_parameter<L>(entry<&L::poisson>)};
  }

  static constexpr std::string_view name = "LinearElastic";
  static constexpr std::array state_names{"plastic_strain"};

  bool operator==(const LinearElastic&) const = default;
};

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const LinearElastic& law);

/// Updates the stress of a batch of points (and fills its tangent where wanted).
template <int D>
BatchReport update(const LinearElastic& law, const PointBatch<D>& points);
} // namespace mpm::materials
