#pragma once

#include "materials/laws/law_list.h"

namespace mpm::materials
{
/// A law of which some parameters differ from point to point, such as a strength that grows with depth.
///
/// Each of them has a state variable, the last ones of the law, with what the point's value exceeds the law's number
/// by; so points whose states are zero have the law's numbers. Points of equal values that follow one another are
/// updated at once.
struct Heterogeneous
{
  LawList<> law;
  std::vector<std::string> varying; ///< names of the parameters
  double strength_factor = 1;       ///< what the strength of all points is divided by, for strength reduction

  static constexpr std::array<Parameter<Heterogeneous>, 0> parameters() { return {}; }
  static constexpr std::array parts{Part{"law", "law whose parameters vary; all of them must be numbers"},
                                    Part{"varying", "names of the parameters that vary, a list"}};

  bool operator==(const Heterogeneous&) const = default;
};

inline std::string law_name(const Heterogeneous& law) { return "Heterogeneous " + law_name(law.law); }

inline int n_state(const Heterogeneous& law) { return n_state(law.law) + static_cast<int>(law.varying.size()); }

/// Names of the law's state variables, then NAME_difference for each parameter that varies
std::vector<std::string> state_names(const Heterogeneous& law);

/// Throws InputError when the law's numbers are out of their range, or a parameter is not one that may vary.
void check(const Heterogeneous& law);

/// The law of one point.
/// @param differences  of its parameters that vary, in their order
LawList<> law_of_point(const Heterogeneous& law, const std::vector<double>& differences);

/// Modulus of the compression wave [Pa] with the law's numbers, than which no point may be stiffer
inline double p_wave_modulus(const Heterogeneous& law) { return p_wave_modulus(law.law); }

inline double shear_modulus(const Heterogeneous& law) { return shear_modulus(law.law); }

inline Needs needs(const Heterogeneous& law) { return needs(law.law); }

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the update).
template <int D>
BatchReport update(const Heterogeneous& law, const PointBatch<D>& points);
} // namespace mpm::materials
