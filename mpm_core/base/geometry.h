#pragma once
/// @file
/// What a geometry adds to a mesh of dimension D: which strains there are, and over what volume a cell is integrated.
///
/// A geometry is a type without data that the kernels take as a parameter:
/// - `dim`: dimension of mesh, positions and velocities.
/// - `n_normal`: normal strains that the motion can cause, over which a change of volume is spread.
/// - `n_working`: components of stress that do work on the motion.
/// - `has_hoop`: whether a radial velocity strains rings about the axis.
///
/// In axial symmetry x is the radius r and y the axis. Masses, volumes, forces and energies are those of one radian,
/// dV = r dA. The hoop strain of a cell is that at its centre, v_r(r_c) / r_c, and the hoop stress acts with the same
/// r_c, so that internal forces and strains are conjugate: their work is that of the stresses exactly. A velocity
/// v_r = a r, v_y = b y has its exact strain, and a cell's volume, the integral of r dA, is r_c A exactly.

#include "base/tensor.h"

namespace mpm::base
{
struct PlaneStrain
{
  static constexpr int dim = 2;
  static constexpr int n_normal = 2;
  static constexpr int n_working = 3;
  static constexpr bool has_hoop = false;
};

struct Axisymmetric
{
  static constexpr int dim = 2;
  static constexpr int n_normal = 3;
  static constexpr int n_working = 4;
  static constexpr bool has_hoop = true;
};

struct Solid
{
  static constexpr int dim = 3;
  static constexpr int n_normal = 3;
  static constexpr int n_working = 6;
  static constexpr bool has_hoop = false;
};

/// The geometry of a dimension where nothing else is said.
template <int D>
using Cartesian = std::conditional_t<D == 2, PlaneStrain, Solid>;

/// Components of a symmetric tensor that do work: first those of `symmetric_pairs`, then that of the hoop.
template <class G>
using Working = std::array<double, G::n_working>;

/// Component of stress that each of them is: xx yy xy (zz) in two dimensions.
template <class G>
inline constexpr std::array<int, G::n_working> working_component = []
{
  std::array<int, G::n_working> components{};
  for (int k = 0; k < n_symmetric<G::dim>; ++k)
    components[k] = stress_component<G::dim>[k];
  if constexpr (G::has_hoop)
    components[n_symmetric<G::dim>] = 2;
  return components;
}();

/// Which of the working components are normal ones: the first D, and the hoop.
template <class G>
inline constexpr std::array<int, G::n_normal> normal_component = []
{
  std::array<int, G::n_normal> components{};
  for (int a = 0; a < G::dim; ++a)
    components[a] = a;
  if constexpr (G::has_hoop)
    components[G::dim] = n_symmetric<G::dim>;
  return components;
}();

/// Volume over area in the plane at a place: r in axial symmetry, per radian; 1 elsewhere.
template <class G>
inline double thickness(const Vector<G::dim>& x)
{
  if constexpr (G::has_hoop)
    return x[0];
  else
    return 1;
}
} // namespace mpm::base
