#pragma once
/// @file
/// The tangent of the Hardening Soil law, consistent with its return.

#include "materials/laws/hardening_soil_return.h"
#include "materials/tools/side_by_side.h"

namespace mpm::materials::hardening_soil
{
/// The deviator of the strain increment of a point, or of a few
template <int D, class N>
std::array<N, n_stress<D>> deviatoric_strain(const PointBatch<D>& points, Index i)
{
  return deviator<D, N>(tensors_of<D, N>(points, i).second);
}

/// Changes a tangent by the strain increment that counts into one by that of the point, on which the small-strain
/// stiffness depends as well.
/// @param by_stiffness, by_softening  derivatives of the stress
template <int D>
void add_small_strain(const Soil& soil, const PointBatch<D>& points, Index i, double scale,
                      const SymTensor<D>& by_stiffness, const SymTensor<D>& by_softening, double* tangent)
{
  constexpr std::size_t n = n_stress<D>;
  const StiffeningSlopes<D> slopes =
      stiffening_slopes<D>(soil.small, points, i, deviatoric_strain<D, double>(points, i));
  for (std::size_t row = 0; row < n; ++row)
  {
    double by_scale = 0;
    for (std::size_t k = 0; k < n; ++k)
      by_scale += tangent[row * n + k] * points.strain_increment[k][i];
    for (std::size_t k = 0; k < n; ++k)
      tangent[row * n + k] = scale * tangent[row * n + k] + by_scale * slopes.strain[k] +
                             by_stiffness[row] * slopes.stiffness[k] + by_softening[row] * slopes.softening[k];
  }
}

template <int D>
void write_tangent(const Soil& soil, const Start<double>& start, const Solution<double>& solution,
                   const Deviators<D, double>& deviators, const PointBatch<D>& points, Index i, double* tangent)
{
  using T = Dual<7>;
  const auto change = [](std::size_t number) { return variable<7>(0.0, number); };
  const auto& [log_stress, mobilised] = solution.at;
  const End<T> end = end_of<T>(soil, start, {variable<7>(log_stress, 0), variable<7>(mobilised, 1)},
                               {change(2), change(3), change(4), change(5), change(6)});
  const auto& volume = end.volumetric.slopes;
  const auto& shape = end.deviatoric.slopes;
  const double determinant = volume[0] * shape[1] - volume[1] * shape[0];
  // Derivative of a number of the end by one of the changes, with the unknowns as the equations have them
  const auto total = [&](const T& number, std::size_t by)
  {
    const double by_stress = solution.is_loose ? 0 : (volume[1] * shape[by] - shape[1] * volume[by]) / determinant;
    const double by_mobilised = -(shape[by] + shape[0] * by_stress) / shape[1];
    return number.slopes[by] + number.slopes[0] * by_stress + number.slopes[1] * by_mobilised;
  };
  const double trial_q = end.trial_q.value;
  const T ratio = trial_q > 0 ? end.q / end.trial_q : T{1.0};
  const auto slopes = [&](std::size_t by) {
    return SecantSlopes{total(end.pressure, by), total(end.shear_modulus, by), total(ratio, by)};
  };
  const SecantTrial<D> trial = secant_trial<D>(end.shear_modulus.value, deviators.stress, deviators.strain);
  write_secant_tangent<D>(trial, deviators.strain, ratio.value, slopes(2), slopes(3), tangent);
  const double cosine = lode_cosine(polynomial<double>(start.cube, 2 * trial.shear), trial.q);
  add_secant_tangent<D>(trial, deviators.strain, ratio.value, slopes(4),
                        lode_cosine_slope<D>(trial.deviator, trial.q, cosine), tangent);
  if (!soil.small.exists())
    return;
  add_small_strain<D>(soil, points, i, start.small.strain,
                      stress_slope<D>(trial, deviators.strain, ratio.value, slopes(5)),
                      stress_slope<D>(trial, deviators.strain, ratio.value, slopes(6)), tangent);
}
} // namespace mpm::materials::hardening_soil
