#pragma once

#include "materials/laws/heterogeneous.h"

#include <cmath>

namespace mpm::materials
{
/// A law taken between Kirchhoff stress and logarithmic strain, for strains that are not small.
///
/// The law works on the Kirchhoff stress tau = J sigma, with J the ratio of volume to that at the start; the strain
/// increments add up to the logarithmic strain. So an elastic law becomes Hencky's, tau linear in the logarithmic
/// strain, as far as the principal directions of strain turn with the material; the rate form in the Cauchy stress is
/// softer in compression. The points' stress stays the Cauchy stress. Source: de Souza Neto, Peric, Owen (2008),
/// Computational Methods for Plasticity, section 14.3.
struct Hencky
{
  LawList<Heterogeneous> law;

  static constexpr std::array<Parameter<Hencky>, 0> parameters() { return {}; }
  static constexpr std::array parts{
      Part{"law", "any law but Undrained; it computes the Kirchhoff stress, and particles have the Cauchy stress"}};

  bool operator==(const Hencky&) const = default;
};

inline std::string law_name(const Hencky& law) { return "Hencky of " + law_name(law.law); }

/// One more than those of the law: the last is `log_volume`, ln J
inline int n_state(const Hencky& law) { return n_state(law.law) + 1; }
std::vector<std::string> state_names(const Hencky& law);

/// Throws InputError when a parameter of the law is out of its range.
void check(const Hencky& law);

/// Modulus of the compression wave [Pa] where the volume has not changed
double p_wave_modulus(const Hencky& law);

inline Needs needs(const Hencky& law) { return needs(law.law); }

inline double shear_modulus(const Hencky& law) { return shear_modulus(law.law); }

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the update).
template <int D>
BatchReport update(const Hencky& law, const PointBatch<D>& points);
} // namespace mpm::materials
