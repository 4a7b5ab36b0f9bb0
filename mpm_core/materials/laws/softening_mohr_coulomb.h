#pragma once

#include "materials/laws/batch.h"
#include "materials/laws/mohr_coulomb.h"

namespace mpm::materials
{
/// How strength falls from its peak to its residual
enum class Softening
{
  linear,     ///< along a line, residual after the softening strain
  exponential ///< by exp(-plastic strain / softening strain)
};

/// Mohr-Coulomb whose cohesion, friction and dilation angle fall from a peak to a residual with the accumulated plastic
/// deviatoric strain.
///
/// The strain over which they fall is that of a band of the width `reference_length`. Softening localises into bands as
/// wide as a cell, whatever its size; so that the energy that a band dissipates does not depend on the mesh, a point in
/// a cell of size h softens over softening_strain * reference_length / h. Without a cell h is the reference length.
/// Sources: Bazant, Oh (1983), Materials and Structures 16, 155-177 (energy by band width); Vermeer, de Borst (1984),
/// HERON 29(3) (strength in plastic strain).
struct SofteningMohrCoulomb
{
  MohrCoulomb peak;
  double residual_cohesion, residual_friction_angle, residual_dilation_angle, softening_strain, reference_length;
  Softening shape = Softening::exponential;

  static constexpr auto parameters()
  {
    using L = SofteningMohrCoulomb;
    constexpr auto friction = entry<&L::residual_friction_angle>;
    return std::array{
        parameter<L>("residual_cohesion", entry<&L::residual_cohesion>, "Pa",
                     up_to<L>("peak.cohesion", entry<&L::peak, &MohrCoulomb::cohesion>), "residual cohesion"),
        parameter<L>("residual_friction_angle", friction, "degrees",
                     up_to<L>("peak.friction_angle", entry<&L::peak, &MohrCoulomb::friction_angle>),
                     "residual friction angle"),
        parameter<L>("residual_dilation_angle", entry<&L::residual_dilation_angle>, "degrees",
                     up_to<L>("residual_friction_angle", friction), "residual dilation angle", 0.0),
        parameter<L>("softening_strain", entry<&L::softening_strain>, "-", above<L>(0),
                     "plastic deviatoric strain over which the strength falls, in a band of the reference length"),
        parameter<L>("reference_length", entry<&L::reference_length>, "m", above<L>(0),
                     "cell size for which the softening strain holds"),
    };
  }
  static constexpr std::array parts{
      Part{"peak", "MohrCoulomb law with elasticity, peak strength and tension cut-off"},
      Part{"shape", "Softening.EXPONENTIAL, by exp(-plastic strain / softening_strain), or LINEAR", false}};

  static constexpr std::string_view name = "SofteningMohrCoulomb";
  /// `band_strain` is the plastic strain that a band of the reference length would have: each increment of the plastic
  /// strain counts h / reference_length times in a cell of size h. The strength follows from it, so that it never rises
  /// again when a particle comes into a smaller cell. `cohesion_deviation` is the relative deviation of the point's
  /// cohesion, peak and residual, from the law's, for random fields; at least -1.
  static constexpr std::array state_names{"plastic_strain", "band_strain", "cohesion_deviation", "separation"};
  static constexpr Needs special_needs{.cell_size = true};

  bool operator==(const SofteningMohrCoulomb&) const = default;
};

/// Throws InputError when a parameter is out of its range.
inline void check(const SofteningMohrCoulomb& law)
{
  check_parameters(law.peak);
  check_parameters(law);
}

/// The perfectly plastic law that holds at some states
MohrCoulomb softened(const SofteningMohrCoulomb& law, double band_strain, double cohesion_deviation);

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const SofteningMohrCoulomb& law);

inline double shear_modulus(const SofteningMohrCoulomb& law) { return law.peak.young / (2 * (1 + law.peak.poisson)); }

/// Updates stress and state of a batch of points. The strength is that of the plastic strain at the increment's end
/// (implicit), and so is the tangent. A failed point is given the elastic tangent.
template <int D>
BatchReport update(const SofteningMohrCoulomb& law, const PointBatch<D>& points);
} // namespace mpm::materials
