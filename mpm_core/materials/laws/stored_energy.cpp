#include "materials/laws/stored_energy.h"

#include "materials/tools/elasticity.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::materials
{
namespace
{
/// Mean of the normal components, and the square of the deviatoric stress s : s.
struct Invariants
{
  double mean, deviator_squared;
};

template <int D>
Invariants invariants(const SymTensor<D>& stress)
{
  const double mean = (stress[0] + stress[1] + stress[2]) / 3;
  double squared = 0;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    squared += k < 3 ? (stress[k] - mean) * (stress[k] - mean) : 2 * stress[k] * stress[k];
  return {mean, squared};
}

/// Laws with constant moduli
template <int D, class L>
requires requires(L law) { law.young + law.poisson; }
double energy(const L& law, const SymTensor<D>& stress, const double*)
{
  const auto [mean, squared] = invariants<D>(stress);
  const double shear = law.young / (2 * (1 + law.poisson)), bulk = law.young / (3 * (1 - 2 * law.poisson));
  return mean * mean / (2 * bulk) + squared / (4 * shear);
}

template <int D>
double energy(const SofteningMohrCoulomb& law, const SymTensor<D>& stress, const double* state)
{
  return energy<D>(law.peak, stress, state);
}

template <int D>
double energy(const ViscoplasticMohrCoulomb& law, const SymTensor<D>& stress, const double* state)
{
  return energy<D>(law.inviscid, stress, state);
}

/// With moduli in proportion to the pressure: along the swelling line, then at constant pressure
/// @param bulk        bulk modulus over the pressure [-]
/// @param attraction  [Pa], where the pressure is zero
template <int D>
double energy_by_pressure(double bulk, double poisson, double attraction, const SymTensor<D>& stress)
{
  const auto [mean, squared] = invariants<D>(stress);
  const double pressure = attraction - mean;
  const double shear = 1.5 * bulk * pressure * (1 - 2 * poisson) / (1 + poisson);
  const double tension = attraction > 0 ? attraction * std::log(pressure / attraction) : 0;
  return (pressure - attraction - tension) / bulk + squared / (4 * shear);
}

template <int D>
double energy(const CamClay& law, const SymTensor<D>& stress, const double* state)
{
  const double bulk = (1 + law.void_ratio) * std::exp(state[2]) / law.swelling;
  return energy_by_pressure<D>(bulk, law.poisson, law.attraction, stress);
}

template <int D>
double energy(const NorSand& law, const SymTensor<D>& stress, const double*)
{
  return energy_by_pressure<D>(bulk_per_pressure(law), law.poisson, law.attraction, stress);
}

/// With moduli in proportion to the root of the pressure, and the present void ratio
template <int D>
double energy(const Sanisand& law, const SymTensor<D>& stress, const double* state)
{
  const auto [mean, squared] = invariants<D>(stress);
  const double pressure = law.attraction - mean, start = law.attraction;
  const double shear = shear_modulus(law, pressure, (1 + law.void_ratio) * std::exp(state[1]) - 1);
  const double root = std::sqrt(std::max(pressure, Sanisand::least_pressure)),
               bulk_per_root = bulk_per_shear(law) * shear / root;
  const double volumetric = 2.0 / 3 * root * root * root - 2 * start * root + 4.0 / 3 * start * std::sqrt(start);
  return volumetric / bulk_per_root + squared / (4 * shear);
}

/// (x^k - y^k) / k, for k = 0 as well
double power_difference(double x, double y, double k)
{
  return std::abs(k) < 1e-9 ? std::log(x / y) : (std::pow(x, k) - std::pow(y, k)) / k;
}

/// With moduli in proportion to a power of the pressure, of which the present ones are known, along the path of
/// constant ratios of stress to the apex, then at constant pressure
template <int D>
double energy(const HardeningSoil& law, const SymTensor<D>& stress, const double*)
{
  const auto [mean, squared] = invariants<D>(stress);
  const double apex = attraction(law), least = 1e-4 * (law.reference_pressure + apex), m = law.exponent;
  const double pressure = std::max(apex - mean, least), start = std::max(apex, least);
  const double young = unloading_modulus(law, smallest_stress<D>(law, stress));
  const double bulk = young / (3 * (1 - 2 * law.poisson)), shear = young / (2 * (1 + law.poisson));
  const double volumetric = power_difference(pressure, start, 2 - m) - start * power_difference(pressure, start, 1 - m);
  return std::pow(pressure, m) / bulk * volumetric + squared / (4 * shear);
}

template <int D>
double energy(const ExternalLaw&, const SymTensor<D>&, const double*)
{
  return std::numeric_limits<double>::quiet_NaN();
}

template <int D>
double energy(const Umat&, const SymTensor<D>&, const double*)
{
  return std::numeric_limits<double>::quiet_NaN();
}

template <int D, class... L>
double energy(const std::variant<L...>& law, const SymTensor<D>& stress, const double* state);

template <int D>
double energy(const Heterogeneous& law, const SymTensor<D>& stress, const double* state)
{
  const double* const first = state + n_state(law.law);
  return energy<D>(law_of_point(law, {first, first + law.varying.size()}), stress, state);
}

template <int D>
double energy(const Hencky& law, SymTensor<D> stress, const double* state)
{
  const double ratio = std::exp(state[n_state(law) - 1]);
  for (double& component : stress)
    component *= ratio;
  return energy<D>(law.law, stress, state) / ratio;
}

template <int D>
double energy(const Undrained& law, SymTensor<D> stress, const double* state)
{
  const double pressure = state[n_state(law) - 1];
  for (std::size_t k = 0; k < 3; ++k)
    stress[k] += pressure;
  return energy<D>(law.skeleton, stress, state) + 0.5 * pressure * pressure * law.porosity / law.water_modulus;
}

template <int D, class... L>
double energy(const std::variant<L...>& law, const SymTensor<D>& stress, const double* state)
{
  return std::visit([&](const auto& l) { return energy<D>(l, stress, state); }, law);
}
} // namespace

template <int D>
double stored_energy(const Law& law, const SymTensor<D>& stress, const double* state)
{
  return energy<D>(law, stress, state);
}

template double stored_energy<2>(const Law&, const SymTensor<2>&, const double*);
template double stored_energy<3>(const Law&, const SymTensor<3>&, const double*);
} // namespace mpm::materials
