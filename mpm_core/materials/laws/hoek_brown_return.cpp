#include "materials/laws/hoek_brown_return.h"

#include "materials/tools/root.h"

namespace mpm::materials::hoek_brown
{
namespace
{
/// Steps of Newton's method and bisections of one return; three or four are usual in small increments
constexpr int most_steps = 100;

/// By how much the largest principal stress of a return may be off the point where its tangent touches, over the size
/// of the stresses. It is small, as the criterion is strongly curved near its end in tension.
constexpr double accuracy = 1e-12;

/// By how much a stress may be outside and count as elastic, such as one that was returned
constexpr double round_off = 1e-12;

/// By how much the largest tension is below the tensile strength, relatively. There the criterion ends, with a slope
/// without limit.
constexpr double distance_to_end = 1e-6;
} // namespace

Criterion criterion(const HoekBrown& law)
{
  const auto [mb, s, a] = hoek_brown_constants(law);
  const double strength = s * law.intact_strength / mb; // in tension
  Criterion c{elastic_moduli(law.young, law.poisson),
              law.poisson,
              law.intact_strength,
              mb,
              s,
              a,
              law.strength_factor,
              law.dilation_ratio,
              std::min(law.tension_cutoff, (1 - distance_to_end) * strength),
              0};
  const auto excess = [&](double y) { return tangent_at(c, y).touch - c.tension; };
  const double low = 1e-3 * distance_to_end * s;
  double high = s;
  while (excess(high) > 0)
    high *= 2;
  c.y_least = root_between(excess, {low, excess(low)}, {high, excess(high)});
  return c;
}

Principal change_by_flow(const Surface& m, const mohr_coulomb::Matrix3& map, Principal trial, Returned returned)
{
  const double d1 = trial.s1 - returned.stress.s1, d2 = trial.s2 - returned.stress.s2,
               d3 = trial.s3 - returned.stress.s3;
  const double twice_shear = 2 * m.moduli.shear;
  const double volumetric = (d1 + d2 + d3) * m.moduli.lambda / (3 * m.moduli.lambda + twice_shear);
  const double e2 = (d2 - volumetric) / twice_shear, e3 = (d3 - volumetric) / twice_shear; // plastic strains
  // Multipliers of the plane between s1 and s3, and of the second one of an edge; each changes both of its strains by
  // a half per sine.
  double first = -2 * e3 / (1 - m.sin_psi), second = 0;
  std::array<double, 3> change{0.5 * first, 0, 0.5 * first};
  if (returned.region == Region::compression_edge) // between s2 and s3
  {
    second = 2 * e2 / (1 + m.sin_psi);
    change = {0.5 * (first - second), 0.5 * second, 0.5 * first};
  }
  else if (returned.region == Region::extension_edge) // between s1 and s2
  {
    second = -2 * e2 / (1 - m.sin_psi);
    change = {0.5 * (first + second), 0.5 * second, 0.5 * first};
  }
  const double mean = m.moduli.lambda * (change[0] + change[1] + change[2]);
  std::array<double, 3> result{};
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      result[i] -= map[i][j] * (mean + twice_shear * change[j]);
  return {result[0], result[1], result[2]};
}

namespace
{
/// Whether a trial stress is admissible; false as well where the strength is divided, for which there is no formula
bool is_inside(const Criterion& c, Principal trial)
{
  if (c.factor != 1 || trial.s1 > c.tension)
    return false;
  const double y = c.s - trial.s1 * c.mb / c.intact_strength;
  const double allowed = c.intact_strength * std::pow(y, c.a), difference = trial.s1 - trial.s3;
  return difference <= allowed + round_off * (std::abs(trial.s1) + std::abs(trial.s3));
}
} // namespace

Solution return_to_criterion(const Criterion& c, Principal trial)
{
  if (is_inside(c, trial))
    return {{trial, Region::elastic}, {}, {}, true};
  double y = std::max(c.y_least, c.s - trial.s1 * c.mb / c.intact_strength);
  double low = 0, high = std::numeric_limits<double>::infinity();
  for (int step = 0; step < most_steps; ++step)
  {
    const Tangent t = tangent_at(c, y);
    const Surface m = surface_of(c, t);
    const Returned returned = mohr_coulomb::return_to_surface(m, trial);
    const double excess = returned.stress.s1 - t.touch;
    const double size = t.size + std::abs(trial.s1) + std::abs(trial.s3);
    if (std::abs(excess) <= accuracy * size)
      return {returned, m, t, true};
    (excess > 0 ? high : low) = y;
    double slope = -t.touch_per_y;
    if (t.sin_psi_per_y != 0 && returned.region != Region::elastic)
      slope += t.sin_psi_per_y * change_by_flow(m, mohr_coulomb::region_map(m, returned.region), trial, returned).s1;
    const double next = std::max(c.y_least, y - excess / slope);
    const bool within = next > low && next < high;
    y = within ? next : (high < std::numeric_limits<double>::infinity() ? 0.5 * (low + high) : 2 * y);
  }
  return {}; // not converged
}
} // namespace mpm::materials::hoek_brown
