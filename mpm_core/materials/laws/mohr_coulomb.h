#pragma once

#include "materials/laws/batch.h"

#include <limits>

namespace mpm
{
/// Mohr-Coulomb, linear elastic and perfectly plastic, with non-associated flow and a tension cut-off.
///
/// With the principal stresses s1 >= s2 >= s3 (tension positive) a stress is admissible when
///     (s1 - s3)/2 + (s1 + s3)/2 sin(phi) - c cos(phi) <= 0   and   s1 <= tension_cutoff.
/// The flow on a Mohr-Coulomb plane is that of the same plane with the angle psi in place of phi; the flow on a
/// tension plane is associated. With psi = 0 < phi no flow leads to the apex: a trial stress beyond it is returned to
/// the apex by convention. A friction angle of 0 is the Tresca criterion with the strength c in shear.
/// Source: Clausen, Damkilde, Andersen (2006), IJNME 66, 1967-1989, and (2007), Comput. Struct. 85, 1795-1807.
struct MohrCoulomb
{
  /// Young's modulus [Pa], > 0
  double young;
  /// Poisson's ratio [-], in (-1, 0.5)
  double poisson;
  /// Cohesion c [Pa], >= 0
  double cohesion;
  /// Friction angle phi [degrees], in [0, 90)
  double friction_angle;
  /// Dilation angle psi [degrees], in [0, phi]
  double dilation_angle = 0;
  /// Largest principal stress allowed [Pa], >= 0; without effect from c cot(phi) upwards
  double tension_cutoff = std::numeric_limits<double>::infinity();

  static constexpr std::string_view name = "MohrCoulomb";
  static constexpr std::array state_names{"plastic_strain"};

  bool operator==(const MohrCoulomb&) const = default;
};

/// Throws InputError when a parameter is out of its range.
void check(const MohrCoulomb& law);

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const MohrCoulomb& law);

/// Updates stress and state of a batch of points (and fills its tangent where wanted). The tangent is consistent with
/// the return: the derivative of the final stress by the strain increment. A failed point is given the elastic one.
template <int D>
BatchReport update(const MohrCoulomb& law, const PointBatch<D>& points);
} // namespace mpm
