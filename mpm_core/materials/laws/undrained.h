#pragma once

#include "materials/laws/hencky.h"

namespace mpm
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
  LawList<Hencky> skeleton;
  /// Bulk modulus of the pore water K_w [Pa], > 0; 2.2 GPa without air
  double water_modulus;
  /// Porosity n [-], in (0, 1)
  double porosity;

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

inline double shear_modulus(const Undrained& law) { return shear_modulus(law.skeleton); }

/// Updates stress and state of a batch of points (and fills its tangent where wanted, consistent with the update).
template <int D>
BatchReport update(const Undrained& law, const PointBatch<D>& points);
} // namespace mpm
