#include "materials/laws/cam_clay.h"

#include "materials/tools/elasticity.h"
#include "materials/tools/root.h"
#include "materials/tools/secant.h"

namespace mpm::materials
{
namespace
{
/// A point at the start of an increment: pressures and volumetric strains are positive in compression here
template <int D>
struct Start
{
  double elastic, plastic; ///< v / kappa and v / (lambda - kappa)
  double shear_ratio;      ///< G / K
  double slope_squared;    ///< M^2
  double pressure;         ///< p
  double preconsolidation; ///< p_c
  double volumetric;       ///< volumetric strain increment
  SymTensor<D> deviator;   ///< of the stress
  SymTensor<D> strain;     ///< deviatoric strain increment, tensor components
};

/// What follows from the plastic part x of the volumetric strain and the plastic multiplier m
template <int D>
struct Result
{
  double x, multiplier;
  double y; ///< ln of the growth of the pressure
  double pressure, preconsolidation;
  SecantTrial<D> trial;
  double ratio; ///< of the deviator to that of the trial

  double yield(double slope_squared) const
  {
    const double q = ratio * trial.q;
    return q * q / slope_squared + pressure * (pressure - preconsolidation);
  }
};

template <int D>
Result<D> result_of(const Start<D>& a, double x, double multiplier)
{
  Result<D> r;
  r.x = x;
  r.multiplier = multiplier;
  r.y = a.elastic * (a.volumetric - x);
  const Growth growth = growth_of(r.y);
  r.pressure = a.pressure * growth.factor;
  r.preconsolidation = a.preconsolidation * std::exp(a.plastic * x);
  r.trial = secant_trial<D>(a.shear_ratio * a.elastic * a.pressure * growth.mean, a.deviator, a.strain);
  r.ratio = 1 / (1 + 6 * r.trial.shear * multiplier / a.slope_squared);
  return r;
}

/// The return, for a point that yields. Between x = 0 and the x at which the critical state is reached, 2 p = p_c, the
/// multiplier m = x / (2 p - p_c) rises from 0 to infinity, and the deviator falls from the trial one to 0: between
/// them the yield function has its root. The unknown is the fraction of that x. In small increments the fraction is
/// small, and the secant method takes a few evaluations; where it does not get there, by bracketing.
template <int D>
Result<D> returned(const Start<D>& a)
{
  const double sum = a.elastic + a.plastic;
  const double critical = (std::log(2 * a.pressure / a.preconsolidation) + a.elastic * a.volumetric) / sum;
  const auto at = [&](double fraction)
  {
    const double x = critical * fraction, left = 1 - fraction;
    const double pc = a.preconsolidation * std::exp(a.plastic * x);
    return result_of(a, x, fraction / (left * pc * sum * growth_of(sum * critical * left).mean));
  };
  const double scale = a.preconsolidation * a.preconsolidation;
  const auto excess = [&](const Result<D>& r) { return r.yield(a.slope_squared) / scale; };
  const Sample start{0, excess(at(0))};
  Sample before = start;
  double fraction = 1e-3;
  for (int evaluations = 0; evaluations < 8 && fraction > 0 && fraction < 1; ++evaluations)
  {
    const Result<D> result = at(fraction);
    const Sample now{fraction, excess(result)};
    if (std::abs(now.f) <= 1e-13)
      return result;
    fraction -= now.f * (now.x - before.x) / (now.f - before.f);
    before = now;
  }
  return at(root_between([&](double s) { return excess(at(s)); }, start, {1, -1}));
}

/// Derivatives of a result
/// @param volumetric, trial_q  change of the volumetric strain, and of q of the trial at a fixed shear modulus
template <int D>
SecantSlopes slopes(const Start<D>& a, const Result<D>& r, bool plastic, double volumetric, double trial_q)
{
  const double shear_by_y = a.shear_ratio * a.elastic * a.pressure * growth_of(r.y).slope;
  double dx = 0, dm = 0, ratio_by_y = 0, ratio_by_m = 0;
  if (plastic)
  {
    const double m = r.multiplier, p = r.pressure, pc = r.preconsolidation, m2 = a.slope_squared;
    const double q_by_y = q_by_shear<D>(r.trial, a.strain) * shear_by_y;
    ratio_by_y = -r.ratio * r.ratio * 6 * m * shear_by_y / m2;
    ratio_by_m = -r.ratio * r.ratio * 6 * r.trial.shear / m2;
    const double per_q = 2 * r.ratio * r.trial.q / m2;
    const double by_y = per_q * (r.ratio * q_by_y + r.trial.q * ratio_by_y) + (2 * p - pc) * p;
    // The two equations, x = m (2 p - p_c) and yield = 0, linearised in x and m
    const double a11 = 1 + m * (2 * p * a.elastic + pc * a.plastic), a12 = -(2 * p - pc);
    const double a21 = -p * pc * a.plastic - by_y * a.elastic, a22 = per_q * r.trial.q * ratio_by_m;
    const double b1 = 2 * m * p * a.elastic * volumetric;
    const double b2 = -by_y * a.elastic * volumetric - per_q * r.ratio * trial_q;
    const double determinant = a11 * a22 - a12 * a21;
    dx = (b1 * a22 - a12 * b2) / determinant;
    dm = (a11 * b2 - a21 * b1) / determinant;
  }
  const double dy = a.elastic * (volumetric - dx);
  return {r.pressure * dy, shear_by_y * dy, ratio_by_y * dy + ratio_by_m * dm};
}

template <int D>
Start<D> start_of(const CamClay& law, const PointBatch<D>& points, Index i)
{
  const auto [stress, strain] = tensors_of(points, i);
  const double volume = (1 + law.void_ratio) * std::exp(points.state[2][i]);
  return {volume / law.swelling,
          volume / (law.compression - law.swelling),
          3 * (1 - 2 * law.poisson) / (2 * (1 + law.poisson)),
          law.critical_slope * law.critical_slope,
          law.attraction - mean<D>(stress),
          (law.preconsolidation + law.attraction) * std::exp(points.state[1][i]),
          -3 * mean<D>(strain),
          deviator<D>(stress),
          deviator<D>(strain)};
}

/// Whether an increment can be worked with: there is pressure, and it stays a number.
template <int D>
bool is_sound(const Start<D>& a, const Result<D>& trial)
{
  return a.pressure > 0 && is_usable<D>(trial.trial.deviator) && std::isfinite(trial.pressure * trial.pressure) &&
         std::isfinite(a.preconsolidation * a.preconsolidation) && a.preconsolidation > 0 && std::abs(a.volumetric) < 1;
}

template <int D>
void write_point(const CamClay& law, const Start<D>& a, const Result<D>& r, const PointBatch<D>& points, Index i)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    points.stress[k][i] = r.ratio * r.trial.deviator[k] + (k < 3 ? law.attraction - r.pressure : 0.0);
  points.state[0][i] += 2 * r.multiplier * r.ratio * r.trial.q / a.slope_squared;
  points.state[1][i] += a.plastic * r.x;
  points.state[2][i] -= a.volumetric;
}
} // namespace

double p_wave_modulus(const CamClay& law)
{
  const double bulk = (1 + law.void_ratio) * (2 * law.preconsolidation + law.attraction) / law.swelling;
  return 3 * bulk * (1 - law.poisson) / (1 + law.poisson);
}

double shear_modulus(const CamClay& law)
{
  const double bulk = (1 + law.void_ratio) * (law.preconsolidation + law.attraction) / law.swelling;
  return 3 * bulk * (1 - 2 * law.poisson) / (2 * (1 + law.poisson));
}

template <int D>
BatchReport update(const CamClay& law, const PointBatch<D>& points)
{
  constexpr std::size_t entries = n_stress<D> * n_stress<D>;
  BatchReport report;
  for (Index i = 0; i < points.size; ++i)
  {
    double* const tangent = points.tangent ? points.tangent + static_cast<std::size_t>(i) * entries : nullptr;
    const Start<D> a = start_of(law, points, i);
    const Result<D> trial = result_of(a, 0, 0);
    if (!is_sound(a, trial))
    {
      report.failed.push_back(i);
      if (tangent)
        std::fill_n(tangent, entries, 0.0);
      continue;
    }
    const double round_off = 1e-12 * a.preconsolidation * a.preconsolidation; // a returned stress counts as elastic
    const bool plastic = trial.yield(a.slope_squared) > round_off;
    const Result<D> result = plastic ? returned(a) : trial;
    report.plastic += plastic ? 1 : 0;
    write_point(law, a, result, points, i);
    if (tangent)
      write_secant_tangent<D>(result.trial, a.strain, result.ratio, slopes(a, result, plastic, 1, 0),
                              slopes(a, result, plastic, 0, 1), tangent);
  }
  return report;
}

template BatchReport update<2>(const CamClay&, const PointBatch<2>&);
template BatchReport update<3>(const CamClay&, const PointBatch<3>&);
} // namespace mpm::materials
