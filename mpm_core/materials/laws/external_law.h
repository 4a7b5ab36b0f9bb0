#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

#include <functional>
#include <limits>

namespace mpm::materials
{
/// A law that is not of this library: functions that update a batch, such as ones that call Python.
struct ExternalLaw
{
  /// What it is called in messages
  std::string name;
  /// Names of the state variables; the first is `plastic_strain`
  std::vector<std::string> names;
  /// Modulus of the compression wave [Pa], for the critical time step
  double wave_modulus;
  std::function<BatchReport(const PointBatch<2>&)> plane_strain;
  std::function<BatchReport(const PointBatch<3>&)> solid;
  /// What the functions call: laws that call the same are equal
  const void* identity;
  /// What the functions want to know of a batch
  Needs wants = {};
  /// The law with its strength divided by a factor; empty where its strength is not known
  std::function<ExternalLaw(double)> weaker = {};
  /// tan(psi) / tan(phi), see `associated_fraction`; NaN where it is not known
  double association = std::numeric_limits<double>::quiet_NaN();

  static constexpr std::array<Parameter<ExternalLaw>, 0> parameters() { return {}; }
  static constexpr std::array parts{Part{"law", "an object with the members listed below"}};

  bool operator==(const ExternalLaw& other) const { return identity == other.identity && names == other.names; }
};

inline std::string law_name(const ExternalLaw& law) { return law.name; }
inline int n_state(const ExternalLaw& law) { return static_cast<int>(law.names.size()); }
inline Needs needs(const ExternalLaw& law) { return law.wants; }
inline std::vector<std::string> state_names(const ExternalLaw& law) { return law.names; }
inline double p_wave_modulus(const ExternalLaw& law) { return law.wave_modulus; }
/// Shear modulus for a Poisson's ratio of 1/4
inline double shear_modulus(const ExternalLaw& law) { return law.wave_modulus / 3; }

/// Throws InputError when there are too many or no state variables, or no positive modulus.
void check(const ExternalLaw& law);

template <int D>
BatchReport update(const ExternalLaw& law, const PointBatch<D>& points)
{
  if constexpr (D == 2)
    return law.plane_strain(points);
  else
    return law.solid(points);
}
} // namespace mpm::materials
