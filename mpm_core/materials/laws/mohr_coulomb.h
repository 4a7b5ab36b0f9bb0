#pragma once

#include "materials/laws/batch.h"
#include "materials/tools/parameter.h"

namespace mpm::materials
{
/// Mohr-Coulomb, linear elastic and perfectly plastic, with non-associated flow and a tension cut-off.
///
/// With the principal stresses s1 >= s2 >= s3 (tension positive) a stress is admissible when
///     (s1 - s3)/2 + (s1 + s3)/2 sin(phi) - c cos(phi) <= 0   and   s1 <= tension_cutoff.
/// The flow on a Mohr-Coulomb plane is that of the same plane with the angle psi in place of phi; the flow on a
/// tension plane is associated. With psi = 0 < phi no flow leads to the apex: a trial stress beyond it is returned to
/// the apex by convention. A friction angle of 0 is the Tresca criterion with the strength c in shear. Soil that has
/// been pulled apart at the apex closes again before it carries pressure (tools/separation.h). Source: Clausen,
/// Damkilde, Andersen (2006), IJNME 66, 1967-1989, and (2007), Comput. Struct. 85, 1795-1807.
struct MohrCoulomb
{
  double young, poisson, cohesion, friction_angle;
  double dilation_angle = 0;
  double tension_cutoff = unlimited; ///< without effect from c cot(phi) upwards

  /// The declarations for a law L that has such a soil within it, to which `path` leads
  template <class L, auto... path>
  static constexpr auto parameters_within()
  {
    using M = MohrCoulomb;
    constexpr auto friction = entry<path..., &M::friction_angle>;
    return std::array{
        young_parameter<L>(entry<path..., &M::young>),
        poisson_parameter<L>(entry<path..., &M::poisson>),
        parameter<L>("cohesion", entry<path..., &M::cohesion>, "Pa", at_least<L>(0), "cohesion c"),
        parameter<L>("friction_angle", friction, "degrees", {{0, true}, {90, false}}, "friction angle phi"),
        parameter<L>("dilation_angle", entry<path..., &M::dilation_angle>, "degrees",
                     up_to<L>("friction_angle", friction), "dilation angle psi", 0.0),
        parameter<L>("tension_cutoff", entry<path..., &M::tension_cutoff>, "Pa", or_infinite(at_least<L>(0)),
                     "tension cut-off: largest principal stress; without effect above the apex c cot(phi)", unlimited),
    };
  }
  static constexpr auto parameters() { return parameters_within<MohrCoulomb>(); }

  static constexpr std::string_view name = "MohrCoulomb";
  static constexpr std::array state_names{"plastic_strain", "separation"};

  bool operator==(const MohrCoulomb&) const = default;
};

/// Modulus of the compression wave, K + 4G/3 [Pa], for the critical time step (16)
double p_wave_modulus(const MohrCoulomb& law);

/// Updates stress and state of a batch of points (and fills its tangent where wanted). The tangent is consistent with
/// the return: the derivative of the final stress by the strain increment. A failed point is given the elastic one.
template <int D>
BatchReport update(const MohrCoulomb& law, const PointBatch<D>& points);
} // namespace mpm::materials
