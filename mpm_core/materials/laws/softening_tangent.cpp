#include "materials/laws/softening_tangent.h"

#include "materials/laws/mohr_coulomb_tangent.h"

namespace mpm::materials::mohr_coulomb
{
namespace
{
/// Derivative of the returned principal stresses by the plastic strain, at a fixed trial stress
Principal fall_of_stress(const SofteningPoint& point, double increment)
{
  const double step = 1e-5 / point.strength.per_softening_strain;
  const double low = std::max(0.0, increment - step), high = increment + step;
  const Principal a = point.returned_at(low).stress;
  const Principal b = point.returned_at(high).stress;
  const double size = high - low;
  return {(b.s1 - a.s1) / size, (b.s2 - a.s2) / size, (b.s3 - a.s3) / size};
}

/// Derivative of the plastic strain of a return by the trial stress (principal values) at a fixed surface
Principal strain_gradient(const Surface& m, const Matrix3& map, Principal trial, Principal stress, double increment)
{
  const std::array<double, 3> change{trial.s1 - stress.s1, trial.s2 - stress.s2, trial.s3 - stress.s3};
  const double mean = (change[0] + change[1] + change[2]) / 3;
  const double factor = increment > 0 ? 1 / (6 * m.moduli.shear * m.moduli.shear * increment) : 0.0;
  std::array<double, 3> gradient;
  for (std::size_t j = 0; j < 3; ++j)
  {
    gradient[j] = change[j] - mean;
    for (std::size_t i = 0; i < 3; ++i)
      gradient[j] -= map[i][j] * (change[i] - mean);
    gradient[j] *= factor;
  }
  return {gradient[0], gradient[1], gradient[2]};
}

/// Adds what the loss of strength contributes to the tangent: the stress falls by its derivative by the plastic strain,
/// and the plastic strain grows with the trial stress and with the softening that it causes.
template <int D>
void add_softening(const SofteningPoint& point, const Surface& m, const Matrix3& map, const Frame<D>& frame,
                   Principal stress, double increment, double* tangent)
{
  const Principal trial = point.trial;
  const Principal fall = fall_of_stress(point, increment);
  const Principal gradient = strain_gradient(m, map, trial, stress, increment);
  const Principal d{trial.s1 - stress.s1, trial.s2 - stress.s2, trial.s3 - stress.s3};
  const double mean = (d.s1 + d.s2 + d.s3) / 3;
  const double yielded = increment > 0 ? increment : std::numeric_limits<double>::min();
  const double own = -((d.s1 - mean) * fall.s1 + (d.s2 - mean) * fall.s2 + (d.s3 - mean) * fall.s3) /
                     (6 * m.moduli.shear * m.moduli.shear * yielded);
  const SymTensor<D> by_strain = recomposed(fall, frame), by_trial = recomposed(gradient, frame);
  const double volumetric = m.moduli.lambda * (by_trial[0] + by_trial[1] + by_trial[2]);
  for (std::size_t i = 0; i < n_stress<D>; ++i)
    for (std::size_t j = 0; j < n_stress<D>; ++j)
      tangent[i * n_stress<D> + j] +=
          by_strain[i] * ((j < 3 ? volumetric : 0.0) + 2 * m.moduli.shear * by_trial[j]) / (1 - own);
}
} // namespace

template <int D>
void write_softening_tangent(const SofteningPoint& point, const Frame<D>& frame, double increment, double* tangent)
{
  const Surface m = point.surface_at(increment);
  const Returned returned = return_to_surface(m, point.trial);
  const Matrix3 map = region_map(m, returned.region);
  write_tangent<D>(m, map, {point.trial, frame}, returned, tangent);
  add_softening<D>(point, m, map, frame, returned.stress, increment, tangent);
}

template void write_softening_tangent<2>(const SofteningPoint&, const Frame<2>&, double, double*);
template void write_softening_tangent<3>(const SofteningPoint&, const Frame<3>&, double, double*);
} // namespace mpm::materials::mohr_coulomb
