#pragma once

#include "materials/laws/hencky.h"

namespace mpm::materials
{
/// A saturated soil that does not drain, in effective stresses.
///
/// The law of the skeleton works on the effective stress; the water takes part in the volumetric strain with its bulk
/// modulus over the porosity. The points carry the total stress (less a steady pore pressure, where there is one), so
/// that equilibrium needs to know nothing of the water:
///     sigma = sigma' - u 1,   du = -(water_modulus / porosity) tr(de)
/// with the excess pore pressure u positive in compression. Nodal mixed discretisation averages tr(de), and with it u.
/// Source: Zienkiewicz et al. (1999), Computational Geomechanics, section 2.2 (undrained limit, stiff grains).
struct Undrained
{
  LawList<Heterogeneous, Hencky> skeleton;
  double water_modulus, porosity;

  static constexpr auto parameters()
  {
    using L = Undrained;
    return std::array{parameter<L>("water_modulus", entry<&L::water_modulus>, "Pa", above<L>(0),
                                   "bulk modulus of the pore water K_w; 2.2 GPa is that of water without air", 2.2e9),
                      parameter<L>("porosity", entry<&L::porosity>, "-", between<L>(0, 1), "porosity n")};
  }
  static constexpr std::array parts{Part{"skeleton", "law of the effective stress, any but Undrained"}};

  bool operator==(const Undrained&) const = default;
};

inline std::string law_name(const Undrained& law) { return "Undrained of " + law_name(law.skeleton); }

/// One more than those of the skeleton: the last is `excess_pore_pressure`, u [Pa]
inline int n_state(const Undrained& law) { return n_state(law.skeleton) + 1; }
std::vector<std::string> state_names(const Undrained& law);

/// Throws InputError when a parameter is out of its range.
void check(const Undrained& law);

/// Modulus of the compression wave [Pa], the water's K_w / n included
double p_wave_modulus(const Undrained& law);

inline Needs needs(const Undrained& law) { return needs(law.skeleton); }

inline double shear_modulus(const Undrained& law) { return shear_modulus(law.skeleton); }

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the update).
template <int D>
BatchReport update(const Undrained& law, const PointBatch<D>& points);
} // namespace mpm::materials
