#include "materials/laws/hoek_brown.h"

#include "materials/laws/hoek_brown_return.h"
#include "materials/tools/separation.h"

namespace mpm::materials
{
namespace hoek_brown
{
namespace
{
/// Derivative of the returned principal stresses by the trial ones: that of the return to the tangent, and what the
/// flow changes as its point moves along the criterion.
mohr_coulomb::Matrix3 map_of(const Solution& solution, Principal trial)
{
  const auto& [returned, m, t, converged] = solution;
  mohr_coulomb::Matrix3 map = mohr_coulomb::region_map(m, returned.region);
  if (t.sin_psi_per_y == 0)
    return map;
  const Principal change = change_by_flow(m, map, trial, returned);
  const std::array<double, 3> by_y{change.s1 * t.sin_psi_per_y, change.s2 * t.sin_psi_per_y,
                                   change.s3 * t.sin_psi_per_y};
  const std::array<double, 3> first = map[0];
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      map[i][j] += by_y[i] * first[j] / (t.touch_per_y - by_y[0]);
  return map;
}
} // namespace
} // namespace hoek_brown

HoekBrownConstants hoek_brown_constants(const HoekBrown& law)
{
  const double below = law.geological_strength_index - 100;
  return {law.intact_constant * std::exp(below / (28 - 14 * law.disturbance_factor)),
          std::exp(below / (9 - 3 * law.disturbance_factor)),
          0.5 + (std::exp(-law.geological_strength_index / 15) - std::exp(-20.0 / 3)) / 6};
}

double p_wave_modulus(const HoekBrown& law) { return p_wave_modulus(elastic_moduli(law.young, law.poisson)); }

template <int D>
BatchReport update(const HoekBrown& law, const PointBatch<D>& points)
{
  using namespace hoek_brown;
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  const Criterion c = criterion(law);
  const double bulk = bulk_modulus(c.moduli);
  if (points.tangent)
    fill_elastic_tangent<D>(c.moduli, points.size, points.tangent);
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    SymTensor<D> trial = elastic_trial<D>(c.moduli, points, i);
    const bool usable = is_usable<D>(trial);
    double& separation = points.state[1][i];
    const double closed = usable ? close_separation<D>(trial, separation, bulk) : 0.0;
    const mohr_coulomb::Spectral<D> spectrum = mohr_coulomb::spectral(trial);
    const Solution solution = usable ? return_to_criterion(c, spectrum.stress) : Solution{};
    if (!solution.converged)
    {
      report.failed.push_back(i);
      continue;
    }
    const Returned& returned = solution.returned;
    const bool plastic = returned.region != Region::elastic;
    const SymTensor<D> stress = plastic ? recomposed(returned.stress, spectrum.frame) : trial;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] = stress[k];
    points.state[0][i] += deviatoric_plastic_strain(solution.surface, spectrum.stress, returned.stress);
    separation += tension_beyond_apex(spectrum.stress, returned) / bulk - closed;
    report.plastic += plastic ? 1 : 0;
    if (!points.tangent)
      continue;
    double* const tangent = points.tangent + static_cast<std::size_t>(i) * entries;
    if (plastic)
      write_tangent<D>(solution.surface, map_of(solution, spectrum.stress), spectrum, returned, tangent);
    if (closed > 0 && separation > 0)
      remove_volumetric_part<D>(tangent);
  }
  return report;
}

template BatchReport update<2>(const HoekBrown&, const PointBatch<2>&);
template BatchReport update<3>(const HoekBrown&, const PointBatch<3>&);
} // namespace mpm::materials
