#include "materials/laws/point_moduli.h"

#include <algorithm>
#include <cmath>

namespace mpm::materials
{
namespace
{
WaveModuli moduli_of_bulk(double bulk, double poisson)
{
  return {3 * bulk * (1 - poisson) / (1 + poisson), 3 * bulk * (1 - 2 * poisson) / (2 * (1 + poisson))};
}

/// K of Cam-Clay over its pressure [-]: v / kappa
double bulk_per_pressure(const CamClay& law, double log_volume)
{
  return (1 + law.void_ratio) * std::exp(log_volume) / law.swelling;
}

WaveModuli moduli_of_sand(const Sanisand& law, double pressure, double log_volume)
{
  const double shear = shear_modulus(law, pressure, (1 + law.void_ratio) * std::exp(log_volume) - 1);
  return {(bulk_per_shear(law) + 4.0 / 3) * shear, shear};
}

/// At a smallest principal stress, positive in compression
WaveModuli moduli_of_hardening_soil(const HardeningSoil& law, double stress)
{
  const double growth = unloading_modulus(law, stress) / law.unloading_modulus;
  return {growth * p_wave_modulus(law), growth * shear_modulus(law)};
}

LawList<> own_law(const Heterogeneous& law, std::span<const double> state)
{
  const auto first = state.begin() + n_state(law.law);
  return law_of_point(law, {first, first + static_cast<std::ptrdiff_t>(law.varying.size())});
}

struct DiffersByPoint
{
  template <class L>
  bool operator()(const L&) const
  {
    return false;
  }
  bool operator()(const CamClay&) const { return true; }
  bool operator()(const NorSand&) const { return true; }
  bool operator()(const Sanisand&) const { return true; }
  bool operator()(const HardeningSoil&) const { return true; }
  bool operator()(const Heterogeneous& law) const
  {
    const auto is_elastic = [](const std::string& name)
    { return name == "young" || name == "poisson" || name == "p_wave_modulus"; };
    return std::ranges::any_of(law.varying, is_elastic) || std::visit(*this, law.law);
  }
  bool operator()(const Hencky& law) const { return std::visit(*this, law.law); }
  bool operator()(const Undrained& law) const { return std::visit(*this, law.skeleton); }
};

struct ModuliOfPoint
{
  double mean_stress;
  std::span<const double> state;

  template <class L>
  WaveModuli operator()(const L& law) const
  {
    return {p_wave_modulus(law), shear_modulus(law)};
  }
  WaveModuli operator()(const CamClay& law) const
  {
    const double least = 1e-6 * (law.preconsolidation + law.attraction); // a point without pressure has no stiffness
    const double pressure = std::max(law.attraction - mean_stress, least);
    return moduli_of_bulk(bulk_per_pressure(law, state[2]) * pressure, law.poisson);
  }
  WaveModuli operator()(const NorSand& law) const
  {
    const double least = 1e-6 * (law.reference_pressure + law.attraction); // which its points keep
    return moduli_of_bulk(bulk_per_pressure(law) * std::max(law.attraction - mean_stress, least), law.poisson);
  }
  WaveModuli operator()(const Sanisand& law) const
  {
    return moduli_of_sand(law, law.attraction - mean_stress, state[1]);
  }
  WaveModuli operator()(const HardeningSoil& law) const { return moduli_of_hardening_soil(law, -mean_stress); }
  WaveModuli operator()(const Heterogeneous& law) const { return std::visit(*this, own_law(law, state)); }
  WaveModuli operator()(const Hencky& law) const
  {
    const double ratio = std::exp(state[static_cast<std::size_t>(n_state(law.law))]); // of volumes, J
    return std::visit(ModuliOfPoint{ratio * mean_stress, state}, law.law);
  }
  WaveModuli operator()(const Undrained& law) const
  {
    const double excess = state[static_cast<std::size_t>(n_state(law.skeleton))];
    WaveModuli moduli = std::visit(ModuliOfPoint{mean_stress + excess, state}, law.skeleton);
    moduli.p_wave += law.water_modulus / law.porosity;
    return moduli;
  }
};

struct LimitingModulus
{
  double mean_stress;
  std::span<const double> state;

  template <class L>
  double operator()(const L& law) const
  {
    return p_wave_modulus(law);
  }
  double operator()(const CamClay& law) const
  {
    const double preconsolidation = (law.preconsolidation + law.attraction) * std::exp(state[1]);
    const double carried = law.creep > 0 ? law.attraction - mean_stress : 0.0; // fast loading goes beyond it
    const double most = 2 * std::max(preconsolidation, carried);
    return moduli_of_bulk(bulk_per_pressure(law, state[2]) * (most - law.attraction), law.poisson).p_wave;
  }
  double operator()(const NorSand& law) const
  {
    NorSand now = law;
    now.image_pressure = (law.image_pressure + law.attraction) * std::exp(state[1]) - law.attraction;
    return p_wave_modulus(now);
  }
  double operator()(const Sanisand& law) const
  {
    const double pressure = std::max(2 * (law.attraction - mean_stress), law.largest_pressure + law.attraction);
    return moduli_of_sand(law, pressure, state[1]).p_wave;
  }
  double operator()(const HardeningSoil& law) const
  {
    const double apex = attraction(law);
    return moduli_of_hardening_soil(law, 2 * (apex - mean_stress) - apex).p_wave;
  }
  double operator()(const Heterogeneous& law) const { return std::visit(*this, law.law); }
  double operator()(const Hencky& law) const { return std::visit(*this, law.law); }
  double operator()(const Undrained& law) const
  {
    const double excess = state[static_cast<std::size_t>(n_state(law.skeleton))];
    return std::visit(LimitingModulus{mean_stress + excess, state}, law.skeleton) + law.water_modulus / law.porosity;
  }
};
} // namespace

bool has_moduli_of_points(const Law& law) { return std::visit(DiffersByPoint{}, law); }

WaveModuli moduli_of_point(const Law& law, double mean_stress, std::span<const double> state)
{
  return std::visit(ModuliOfPoint{mean_stress, state}, law);
}

double limiting_modulus(const Law& law, double mean_stress, std::span<const double> state)
{
  return std::visit(LimitingModulus{mean_stress, state}, law);
}
} // namespace mpm::materials
