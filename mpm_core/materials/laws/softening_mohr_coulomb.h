#pragma once

#include "materials/laws/batch.h"
#include "materials/laws/mohr_coulomb.h"

namespace mpm
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
/// a cell of size h softens over softening_strain * reference_length / h.
/// Sources: Bazant, Oh (1983), Materials and Structures 16, 155-177 (energy by band width); Vermeer, de Borst (1984),
/// HERON 29(3) (strength in plastic strain).
struct SofteningMohrCoulomb
{
  /// Elasticity, peak strength, and tension cut-off
  MohrCoulomb peak;
  /// Cohesion in the end [Pa], in [0, peak cohesion]
  double residual_cohesion;
  /// Friction angle in the end [degrees], in [0, peak friction angle]
  double residual_friction_angle;
  /// Dilation angle in the end [degrees], in [0, residual friction angle]
  double residual_dilation_angle;
  /// Plastic deviatoric strain over which the strength falls, in a band of the reference length [-], > 0
  double softening_strain;
  /// Cell size for which the softening strain holds [m], > 0
  double reference_length;
  Softening shape = Softening::exponential;

  static constexpr std::string_view name = "SofteningMohrCoulomb";
  /// `cell_size` [m] is that of the point's cell, 0 stands for the reference length. `cohesion_deviation` is the
  /// relative deviation of the point's cohesion, peak and residual, from the law's, for random fields; at least -1.
  static constexpr std::array state_names{"plastic_strain", "cell_size", "cohesion_deviation"};

  bool operator==(const SofteningMohrCoulomb&) const = default;
};

/// Throws InputError when a parameter is out of its range.
void check(const SofteningMohrCoulomb& law);

/// The perfectly plastic law that holds after some plastic strain, with states as given
MohrCoulomb softened(const SofteningMohrCoulomb& law, double plastic_strain, double cell_size,
                     double cohesion_deviation);

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const SofteningMohrCoulomb& law);

inline double shear_modulus(const SofteningMohrCoulomb& law) { return law.peak.young / (2 * (1 + law.peak.poisson)); }

/// Updates stress and state of a batch of points. The strength is that of the plastic strain at the increment's end
/// (implicit), and so is the tangent. A failed point is given the elastic tangent.
template <int D>
BatchReport update(const SofteningMohrCoulomb& law, const PointBatch<D>& points);
} // namespace mpm
