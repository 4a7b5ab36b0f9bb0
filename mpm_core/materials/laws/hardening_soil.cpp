#include "materials/laws/hardening_soil.h"

#include "materials/laws/hardening_soil_return.h"
#include "materials/laws/hardening_soil_tangent.h"
#include "materials/tools/require.h"
#include "materials/tools/side_by_side.h"

namespace mpm::materials
{
namespace hardening_soil
{
namespace
{
constexpr double degree = std::numbers::pi / 180;
constexpr double most_stress = 1e15; ///< [Pa], of values that can be worked with

/// Stress and strain of first loading in the oedometer at the reference pressure, by the vertical stress
struct Oedometer
{
  double mobilised;               ///< (s1 - s3) / q_f
  double volumetric, deviatoric;  ///< strains per Pa without those of the cap
  double pressure, q;             ///< p + a and q
  double pressure_slope, q_slope; ///< by the vertical stress
};

double normal_k0(const HardeningSoil& law)
{
  return law.normal_k0 > 0 ? law.normal_k0 : 1 - std::sin(law.friction_angle * degree);
}

/// Without the cap, whose constants follow from it
Oedometer oedometer_of(const HardeningSoil& law, const Soil& soil)
{
  const double k0 = normal_k0(law);
  const Dual<1> vertical = variable<1>(law.reference_pressure, 0), smallest = k0 * vertical + soil.attraction;
  const Dual<1> q = vertical - k0 * vertical, mobilised = q / (soil.slope * smallest);
  const double here = softness_of(soil, smallest.value), young = soil.unloading / here;
  const Dual<1> softness = chained(smallest, here, -soil.exponent * here / smallest.value);
  const double sheared = std::max(shear_of(soil, smallest, softness, mobilised).slopes[0], 0.0);
  const double dilation = dilatancy(soil, mobilised.value), pressure_slope = (1 + 2 * k0) / 3;
  const double elastic = pressure_slope / (soil.bulk_per_young() * young);
  return {mobilised.value,
          elastic - dilation * sheared,
          q.slopes[0] / (3 * soil.shear_per_young() * young) + 0.5 * (1 - dilation / 3) * sheared,
          pressure_slope * law.reference_pressure + soil.attraction,
          q.value,
          pressure_slope,
          q.slopes[0]};
}

/// Sets the constants of the cap, so that first loading in the oedometer has its modulus and its K0.
void set_cap(Soil& soil, const HardeningSoil& law, const Oedometer& test)
{
  const double volumetric = 1 / law.oedometer_modulus - test.volumetric;
  const double deviatoric = 2.0 / 3 / law.oedometer_modulus - test.deviatoric;
  const double w = direction_of(soil, 1.0).cap, p = test.pressure, q = test.q;
  soil.cap_slope = std::sqrt(deviatoric / volumetric * p / q) / w;
  const double cap = cap_through(soil, p, q, w), slope = soil.cap_slope * w;
  const double cap_change = (slope * slope * q * test.q_slope + p * test.pressure_slope) / cap;
  soil.cap_modulus = cap_change / volumetric * std::pow(cap / soil.reference, -soil.exponent);
}

/// (s1 - s3) / q_f, at most that of failure
/// @param stress      s3 + a
/// @param difference  s1 - s3
template <class N>
N mobilised_by(const Soil& soil, const N& stress, const N& difference)
{
  return smaller<N>(difference / (soil.slope * stress), N{} + 1);
}

/// gamma of a stress on the hyperbola, at most that of failure
double hyperbola(const Soil& soil, double stress, double difference)
{
  return shear_of(soil, stress, softness_of(soil, stress), mobilised_by(soil, stress, difference));
}

/// Sets gamma and p_p of ground that has carried a vertical stress.
void set_start(Soil& soil, const HardeningSoil& law, double vertical)
{
  const double k0 = normal_k0(law), stress = std::max(k0 * vertical + soil.attraction, least_stress * soil.reference);
  const double q = (1 - k0) * vertical, pressure = std::max((1 + 2 * k0) / 3 * vertical + soil.attraction, stress);
  soil.shear = hyperbola(soil, stress, q);
  soil.cap = cap_through(soil, pressure, q, direction_of(soil, 1.0).cap);
}

/// Stresses of the law from the apex on [Pa]
struct Stresses
{
  double attraction, reference, least;
};

Stresses stresses_of(const HardeningSoil& law)
{
  const double apex = law.cohesion / std::tan(law.friction_angle * degree), reference = law.reference_pressure + apex;
  return {apex, reference, std::max(apex - law.tension_cutoff, least_stress * reference)};
}

/// Shear modulus of unloading at the reference pressure [Pa]
double unloading_shear_modulus(const HardeningSoil& law) { return 0.5 * law.unloading_modulus / (1 + law.poisson); }

SmallStrain small_strain_of(const HardeningSoil& law)
{
  if (law.small_strain_modulus == 0)
    return {};
  return bricks_of(law.small_strain_modulus / unloading_shear_modulus(law), law.threshold_strain,
                   1 + law.unloading_modulus / (2 * law.secant_modulus));
}

/// The soil with its full strength, without cap
Soil uncapped(const HardeningSoil& law)
{
  const auto [apex, reference, least] = stresses_of(law);
  const double sine = std::sin(law.friction_angle * degree), dilation = std::sin(law.dilation_angle * degree);
  return {apex,
          reference,
          2 * sine / (1 - sine),
          (sine - dilation) / (1 - sine * dilation),
          law.secant_modulus,
          law.unloading_modulus,
          law.exponent,
          law.failure_ratio,
          law.poisson,
          (3 + sine) / (3 - sine),
          0,
          1,
          least,
          0,
          0,
          small_strain_of(law)};
}

/// The strength divided by a factor: c / F and tan(phi) / F. The apex c cot(phi) stays.
void reduce(Soil& soil, const HardeningSoil& law)
{
  const double angle = std::atan(std::tan(law.friction_angle * degree) / law.strength_factor);
  const double sine = std::sin(angle), dilation = std::sin(std::min(law.dilation_angle * degree, angle));
  soil.slope = 2 * sine / (1 - sine);
  soil.critical_sine = (sine - dilation) / (1 - sine * dilation);
}
} // namespace

Soil soil_of(const HardeningSoil& law)
{
  Soil soil = uncapped(law);
  set_cap(soil, law, oedometer_of(law, soil));
  set_start(soil, law, law.vertical_preconsolidation);
  if (law.strength_factor != 1)
    reduce(soil, law);
  return soil;
}

/// A deviator's q and the direction of it
template <int D, class N = double>
std::pair<N, Direction<N>> shape_of(const Soil& soil, const std::array<N, n_stress<D>>& deviator)
{
  const N q = root(square_along<D, N>(deviator, {})[0]);
  return {q, direction_of(soil, lode_cosine<N>(-13.5 * determinant<D, N>(deviator), q))};
}

/// gamma, and ln of p_p over that of the law's start
template <class N>
struct Hardening
{
  N shear, growth;
};

/// Those of a point before the increment. Soil that has never been loaded begins with those of its stress, where they
/// are more than those of the law.
/// @param own  those of the stress
template <int D, class N>
Hardening<N> hardening_of(const Soil& soil, const PointBatch<D>& points, Index i, auto&& own)
{
  const N plastic = load_as<N>(points.state[0] + i), shear = load_as<N>(points.state[1] + i);
  const N growth = load_as<N>(points.state[2] + i);
  const Mask<N> is_new = (plastic == 0) & (shear == 0) & (growth == 0);
  Hardening<N> hardening{soil.shear + shear, growth};
  if (any(is_new))
  {
    const Hardening<N> begun = own();
    hardening = {chosen<N>(is_new, larger<N>(begun.shear, N{} + soil.shear), hardening.shear),
                 chosen<N>(is_new, larger<N>(begun.growth, N{}), hardening.growth)};
  }
  return hardening;
}

template <int D, class N>
Start<N> start_of(const Soil& soil, const PointBatch<D>& points, Index i, Deviators<D, N>& deviators)
{
  const auto [stress, strain] = tensors_of<D, N>(points, i);
  deviators = {deviator<D, N>(stress), deviator<D, N>(strain)};
  const Stiffening<N> small = stiffening_of<D, N>(soil.small, points, i, deviators.strain);
  for (N& component : deviators.strain)
    component = small.strain * component;
  const auto [q, direction] = shape_of<D, N>(soil, deviators.stress);
  const N pressure = soil.attraction - mean<D, N>(stress);
  const N smallest = larger<N>(pressure - direction.smallest * q, N{} + soil.least);
  const N softness = softness_of(soil, smallest), mobilised = mobilised_by<N>(soil, smallest, direction.difference * q);
  const auto [shear, growth] =
      hardening_of<D, N>(soil, points, i,
                         [&, q = q, w = direction.cap]
                         {
                           return Hardening<N>{shear_of(soil, smallest, softness, mobilised),
                                               logarithm<N>(cap_through(soil, pressure, q, w) / soil.cap)};
                         });
  const N cap = soil.cap * each(growth, [](double x) { return falling_exponential(-x); });
  return {pressure,
          smallest,
          softness,
          mobilised,
          shear,
          cap,
          growth,
          cap_compliance(soil, cap),
          -3 * mean<D, N>(strain) * small.strain,
          square_along<D, N>(deviators.stress, deviators.strain),
          cube_along<D, N>(deviators.stress, deviators.strain),
          small};
}

template <class N>
Mask<N> is_sound(const Start<N>& start)
{
  return (absolute(start.pressure) + start.stress + start.cap < most_stress) & (absolute(start.shear) < most_stress) &
         (absolute(start.volumetric) + absolute(start.square[1]) + start.square[2] < most_stress);
}

template <class N>
Mask<N> is_sound(const End<N>& end)
{
  return end.pressure + end.trial_q < most_stress;
}

template <int D, class N>
void write(const Soil& soil, const Start<N>& start, const End<N>& end, const Deviators<D, N>& deviators,
           const PointBatch<D>& points, Index i)
{
  const N ratio = chosen<N>(end.trial_q > 0, end.q / end.trial_q, N{});
  write_stress<D, N>(points, i, soil.attraction - end.pressure, ratio, end.shear_modulus, deviators);
  add_to_state<D, N>(points, i, 0, end.plastic);
  store(start.shear + end.shear - soil.shear, points.state[1] + i);
  store(start.growth + end.cap_growth, points.state[2] + i);
  if (soil.small.exists())
    drag<D, N>(soil.small, points, i, deviatoric_strain<D, N>(points, i));
}

template <class N>
Mask<N> is_plastic(const End<N>& end)
{
  return (end.plastic > 0) | (end.cap_growth > 0);
}

template <int D>
Outcome update_point(const Soil& soil, const PointBatch<D>& points, Index i, double* tangent)
{
  Deviators<D, double> deviators;
  const Start<double> start = start_of<D, double>(soil, points, i, deviators);
  const std::optional<Solution<double>> solution = is_sound(start) ? solution_of(soil, start) : std::nullopt;
  if (!solution || !is_sound(solution->end))
    return Outcome::failed;
  if (tangent) // before the states change
    write_tangent<D>(soil, start, *solution, deviators, points, i, tangent);
  write<D, double>(soil, start, solution->end, deviators, points, i);
  return is_plastic(solution->end) || solution->is_loose ? Outcome::plastic : Outcome::elastic;
}

template <int D>
std::optional<Index> update_points(const Soil& soil, const PointBatch<D>& points, Index i)
{
  Deviators<D, Lanes> deviators;
  const Start<Lanes> start = start_of<D, Lanes>(soil, points, i, deviators);
  if (any(!is_sound(start)))
    return {};
  const std::optional<End<Lanes>> end = ends_of(soil, start);
  if (!end || any(!is_sound(*end)))
    return {};
  write<D, Lanes>(soil, start, *end, deviators, points, i);
  return count(is_plastic(*end));
}
} // namespace hardening_soil

namespace
{
/// To five digits
double rounded_down(double number)
{
  const double unit = std::pow(10, std::floor(std::log10(number)) - 4);
  return unit * std::floor(number / unit);
}
} // namespace

void check(const HardeningSoil& law)
{
  using namespace hardening_soil;
  check_parameters(law);
  const double initial = 2 * law.secant_modulus / (2 - law.failure_ratio);
  require(law.unloading_modulus > initial, "unloading_modulus", law.unloading_modulus,
          "above the initial modulus of first loading, 2 secant_modulus / (2 - failure_ratio) = " +
              number_text(initial) + " Pa");
  require(law.small_strain_modulus == 0 || law.small_strain_modulus > unloading_shear_modulus(law),
          "small_strain_modulus", law.small_strain_modulus,
          "0 for none, or above the shear modulus of unloading, unloading_modulus / (2 (1 + poisson)) = " +
              number_text(unloading_shear_modulus(law)) + " Pa");
  const Soil soil = uncapped(law);
  const Oedometer test = oedometer_of(law, soil);
  const double k0 = normal_k0(law);
  require(test.mobilised < 1, "normal_k0", k0,
          "so large that the strength carries level ground under the reference pressure");
  const double most = std::min(1 / std::max(test.volumetric, 0.0), 2.0 / 3 / test.deviatoric);
  require(law.oedometer_modulus < most, "oedometer_modulus", law.oedometer_modulus,
          "below " + number_text(rounded_down(most)) +
              " Pa, which a larger secant_modulus or unloading_modulus raises");
}

template <int D>
double smallest_stress(const HardeningSoil& law, const SymTensor<D>& stress)
{
  const auto [q, direction] = hardening_soil::shape_of<D>(hardening_soil::uncapped(law), deviator<D>(stress));
  return -mean<D>(stress) - direction.smallest * q;
}

double attraction(const HardeningSoil& law) { return hardening_soil::stresses_of(law).attraction; }

double unloading_modulus(const HardeningSoil& law, double stress)
{
  const auto [apex, reference, least] = hardening_soil::stresses_of(law);
  return law.unloading_modulus * std::pow(std::max(stress + apex, least) / reference, law.exponent);
}

double shear_modulus(const HardeningSoil& law)
{
  return std::max(hardening_soil::unloading_shear_modulus(law), law.small_strain_modulus);
}

double p_wave_modulus(const HardeningSoil& law)
{
  return 2 * shear_modulus(law) * (1 - law.poisson) / (1 - 2 * law.poisson);
}

int n_state(const HardeningSoil& law)
{
  using namespace hardening_soil;
  return static_cast<int>(law.small_strain_modulus == 0 ? largest_column
                                                        : first_brick_column + n_bricks * brick_components.size());
}

std::vector<std::string> state_names(const HardeningSoil& law)
{
  std::vector<std::string> names{"plastic_strain", "shear_hardening", "log_preconsolidation"};
  if (law.small_strain_modulus == 0)
    return names;
  names.emplace_back("largest_small_strain");
  for (std::size_t brick = 1; brick <= hardening_soil::n_bricks; ++brick)
    for (const char* component : hardening_soil::brick_component_names)
      names.push_back("brick_" + std::to_string(brick) + "_" + component);
  return names;
}

template <int D>
std::array<double, 2> hardened_to(const HardeningSoil& law, const SymTensor<D>& stress, double overconsolidation)
{
  using namespace hardening_soil;
  const Soil soil = soil_of(law);
  const auto [q, direction] = shape_of<D>(soil, deviator<D>(stress));
  const double pressure = soil.attraction - mean<D>(stress), smallest = pressure - direction.smallest * q;
  const double above = std::max(smallest, soil.least), largest = smallest + direction.difference * q - soil.attraction;
  Soil before = soil;
  if (overconsolidation > 1)
    set_start(before, law, std::max(overconsolidation * largest, 0.0));
  const double shear = std::max({before.shear, soil.shear, hyperbola(soil, above, direction.difference * q)});
  const double cap = std::max({before.cap, soil.cap, cap_through(soil, pressure, q, direction.cap)});
  return {shear - soil.shear, std::log(cap / soil.cap)};
}

template <int D>
BatchReport update(const HardeningSoil& law, const PointBatch<D>& points)
{
  const hardening_soil::Soil soil = hardening_soil::soil_of(law);
  return update_side_by_side(
      points, [&](Index i) { return hardening_soil::update_points<D>(soil, points, i); },
      [&](Index i, double* tangent) { return hardening_soil::update_point<D>(soil, points, i, tangent); });
}

template double smallest_stress<2>(const HardeningSoil&, const SymTensor<2>&);
template double smallest_stress<3>(const HardeningSoil&, const SymTensor<3>&);
template std::array<double, 2> hardened_to<2>(const HardeningSoil&, const SymTensor<2>&, double);
template std::array<double, 2> hardened_to<3>(const HardeningSoil&, const SymTensor<3>&, double);
template BatchReport update<2>(const HardeningSoil&, const PointBatch<2>&);
template BatchReport update<3>(const HardeningSoil&, const PointBatch<3>&);
} // namespace mpm::materials
