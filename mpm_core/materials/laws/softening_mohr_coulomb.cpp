#include "materials/laws/softening_mohr_coulomb.h"

#include "materials/laws/mohr_coulomb_tangent.h"
#include "materials/tools/root.h"

namespace mpm::materials
{
using namespace mohr_coulomb;

namespace
{
Surface surface_of(const MohrCoulomb& law)
{
  constexpr double degree = std::numbers::pi / 180;
  return mohr_coulomb::surface(elastic_moduli(law.young, law.poisson), law.poisson, law.cohesion,
                               law.friction_angle * degree, law.dilation_angle * degree, law.tension_cutoff);
}

/// A trial stress and how the strength falls with the plastic strain of its return
struct Softener
{
  const SofteningMohrCoulomb& law;
  double band_strain;    ///< at the increment's start
  double bands_per_cell; ///< cell size over the reference length
  double cohesion_deviation;
  Principal trial;

  /// Surface after a further plastic strain
  Surface surface(double increment) const { return mohr_coulomb_surface(band_strain + bands_per_cell * increment); }

  Principal returned(double increment) const { return return_to_surface(surface(increment), trial).stress; }

  /// Plastic strain of the return to the surface that holds after some plastic strain
  double plastic_strain(double increment) const
  {
    const Surface m = surface(increment);
    return deviatoric_plastic_strain(m, trial, return_to_surface(m, trial).stress);
  }

  /// Solves the fixed-point equation for the plastic strain increment by the secant method. In small increments the
  /// strength falls little, and a few evaluations suffice; otherwise the root is bracketed.
  double increment() const
  {
    double x = plastic_strain(0), excess = plastic_strain(x) - x;
    double next = x + excess;
    for (int iteration = 0; iteration < 6 && std::abs(excess) > 1e-12 * x && next > 0; ++iteration)
    {
      const double next_excess = plastic_strain(next) - next;
      const double better = next - next_excess * (next - x) / (next_excess - excess);
      x = next;
      excess = next_excess;
      next = better;
    }
    return std::abs(excess) <= 1e-12 * x ? x : bracketed_increment();
  }

  /// The resulting strain stays finite while the strength falls no further than to its residual, so there is a bracket.
  double bracketed_increment() const
  {
    const double first = plastic_strain(0);
    double bound = first;
    double excess = plastic_strain(bound) - bound;
    while (excess > 0)
    {
      bound *= 2;
      excess = plastic_strain(bound) - bound;
    }
    return excess == 0 ? bound
                       : root_between([&](double x) { return plastic_strain(x) - x; }, {0, first}, {bound, excess});
  }

  /// Derivative of the returned principal stresses by the plastic strain, at a fixed trial stress
  Principal derivative(double increment) const
  {
    const double step = 1e-5 * law.softening_strain;
    const double low = std::max(0.0, increment - step), high = increment + step;
    const Principal a = returned(low), b = returned(high);
    const double size = high - low;
    return {(b.s1 - a.s1) / size, (b.s2 - a.s2) / size, (b.s3 - a.s3) / size};
  }

private:
  Surface mohr_coulomb_surface(double strain) const { return surface_of(softened(law, strain, cohesion_deviation)); }
};

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
void add_softening(const Softener& softener, const Surface& m, const Spectral<D>& trial, const Returned& returned,
                   double increment, double* tangent)
{
  const Matrix3 map = region_maps(m).of[static_cast<std::size_t>(returned.region)];
  const Principal fall = softener.derivative(increment);
  const Principal gradient = strain_gradient(m, map, trial.stress, returned.stress, increment);
  const Principal d{trial.stress.s1 - returned.stress.s1, trial.stress.s2 - returned.stress.s2,
                    trial.stress.s3 - returned.stress.s3};
  const double mean = (d.s1 + d.s2 + d.s3) / 3;
  const double yielded = increment > 0 ? increment : std::numeric_limits<double>::min();
  const double own = -((d.s1 - mean) * fall.s1 + (d.s2 - mean) * fall.s2 + (d.s3 - mean) * fall.s3) /
                     (6 * m.moduli.shear * m.moduli.shear * yielded);
  const SymTensor<D> by_strain = recomposed(fall, trial.frame), by_trial = recomposed(gradient, trial.frame);
  const double volumetric = m.moduli.lambda * (by_trial[0] + by_trial[1] + by_trial[2]);
  for (std::size_t i = 0; i < n_stress<D>; ++i)
    for (std::size_t j = 0; j < n_stress<D>; ++j)
      tangent[i * n_stress<D> + j] +=
          by_strain[i] * ((j < 3 ? volumetric : 0.0) + 2 * m.moduli.shear * by_trial[j]) / (1 - own);
}

/// Whether a point is surely elastic: it has its whole strength yet, and the trial stress is inside. Most points of a
/// slope are, and this spares them their own surface and their principal stresses.
template <int D>
bool is_intact(const Surface& peak, const PointBatch<D>& points, Index i, const SymTensor<D>& trial)
{
  return points.state[1][i] == 0 && points.state[2][i] >= 0 && !may_yield(peak, trial);
}

/// Returns one trial stress that may be outside; whether it was.
template <int D>
bool update_point(const SofteningMohrCoulomb& law, const PointBatch<D>& points, Index i, const SymTensor<D>& trial)
{
  const Spectral<D> spectrum = spectral(trial);
  const double bands = points.cell_size ? points.cell_size[i] / law.reference_length : 1;
  const Softener softener{law, points.state[1][i], bands, points.state[2][i], spectrum.stress};
  if (!is_outside(softener.surface(0), spectrum.stress.s1, spectrum.stress.s3))
    return false;
  const double increment = softener.increment();
  const Surface m = softener.surface(increment);
  const Returned returned = return_to_surface(m, spectrum.stress);
  const SymTensor<D> stress = recomposed(returned.stress, spectrum.frame);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    points.stress[k][i] = stress[k];
  points.state[0][i] += increment;
  points.state[1][i] += softener.bands_per_cell * increment;
  if (points.tangent)
  {
    double* const tangent = points.tangent + static_cast<std::size_t>(i) * n_stress<D> * n_stress<D>;
    write_tangent<D>(m, region_maps(m), spectrum, returned, tangent);
    add_softening<D>(softener, m, spectrum, returned, increment, tangent);
  }
  return true;
}
} // namespace

MohrCoulomb softened(const SofteningMohrCoulomb& law, double band_strain, double cohesion_deviation)
{
  const double progress = band_strain / law.softening_strain;
  const double lost = law.shape == Softening::linear ? std::min(progress, 1.0) : -std::expm1(-progress);
  const double factor = std::max(0.0, 1 + cohesion_deviation);
  MohrCoulomb now = law.peak;
  now.cohesion = factor * (now.cohesion + lost * (law.residual_cohesion - now.cohesion));
  now.friction_angle += lost * (law.residual_friction_angle - now.friction_angle);
  now.dilation_angle += lost * (law.residual_dilation_angle - now.dilation_angle);
  return now;
}

double p_wave_modulus(const SofteningMohrCoulomb& law) { return p_wave_modulus(law.peak); }

template <int D>
BatchReport update(const SofteningMohrCoulomb& law, const PointBatch<D>& points)
{
  const ElasticModuli moduli = elastic_moduli(law.peak.young, law.peak.poisson);
  const Surface peak = surface_of(law.peak);
  if (points.tangent)
    fill_elastic_tangent<D>(moduli, points.size, points.tangent);
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    const SymTensor<D> trial = elastic_trial<D>(moduli, points, i);
    if (!is_usable<D>(trial))
    {
      report.failed.push_back(i);
      continue;
    }
    if (!is_intact(peak, points, i, trial) && update_point<D>(law, points, i, trial))
      ++report.plastic;
    else
      for (std::size_t k = 0; k < n_stress<D>; ++k)
        points.stress[k][i] = trial[k];
  }
  return report;
}

template BatchReport update<2>(const SofteningMohrCoulomb&, const PointBatch<2>&);
template BatchReport update<3>(const SofteningMohrCoulomb&, const PointBatch<3>&);
} // namespace mpm::materials
