#pragma once
/// @file
/// The pore water as a phase that moves by itself, where the soil is.

#include "model/velocity_field.h"

namespace mpm::model
{
/// Moments of the soil in one cell that the water needs beside its own; xi is the position from the cell's centre.
template <int D>
struct PoreMoments
{
  Vector<D> volume_xi;     ///< sum V_p xi
  double drag;             ///< sum V_p n^2 gamma_w / k [N s/m]
  Vector<D> drag_xi;       ///< the same times xi
  double pores;            ///< sum n V_p
  Vector<D> pore_velocity; ///< sum n V_p w_p
};

/// Nodal sums of these; plain doubles, so that shared nodes are summed in one message.
template <int D>
struct PoreNode
{
  double volume;     ///< V_i = sum V_p N_i
  double drag;       ///< c_i = sum V_p n^2 gamma_w / k N_i [N s/m]
  Vector<D> outward; ///< sum V_c grad N_i, the integral of N_i n over the surface of the soil
  double around;     ///< sum V_c |grad N_i|
};

/// Part of the surface of its cells that a node needs to be one of the free surface. Nodes within the soil have less,
/// by the error of integration over particles; on a plane surface of squares cut in two it is 0.6.
inline constexpr double at_surface = 0.25;

template <int D>
bool is_at_surface(const PoreNode<D>& node)
{
  return norm<D>(node.outward) >= at_surface * node.around;
}

/// Directions along which no water leaves the soil at a node, (w - v) . direction[k] = 0 for k < count; orthonormal.
template <int D>
struct ImperviousNode
{
  Index node;
  int count;
  std::array<Vector<D>, D> direction;
};

/// `motion` has masses, momenta and velocities of the water; its stresses are -p, its volumes those of the soil, its
/// volumetric strains the mass that leaves a volume over a step [kg/m3].
template <class G, int D = G::dim>
struct WaterField
{
  VelocityField<G> motion;
  std::vector<PoreMoments<D>> cells;
  std::vector<PoreNode<D>> nodes;
  std::vector<Matrix<D>> resistance;   ///< of cells: K^-1 k of their soils by their drag; empty where soil is isotropic
  std::vector<Matrix<D>> drag;         ///< of nodes, in the place of c_i: sum V_p n^2 gamma_w K^-1 N_i; likewise
  std::vector<unsigned char> supplied; ///< per node: 1 where water may enter the soil
  std::vector<ImperviousNode<D>> impervious; ///< at facets of the mesh; by rising node
  std::vector<ImperviousNode<D>> closed;     ///< these, and those at rigid surfaces in this step
  std::vector<Vector<D>> covered;            ///< scratch: areas of rigid surfaces at the nodes, times normals [m2]
  std::vector<Vector<D>> flux;               ///< j_i = m_w,i / V_i (w_i - v_i) [kg/(m2 s)]
};
} // namespace mpm::model
