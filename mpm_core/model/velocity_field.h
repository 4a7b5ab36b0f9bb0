#pragma once
/// @file
/// One velocity on the nodes: what the particles that move with it give them, and how they move.

#include "transfer/dashpots.h"
#include "transfer/dual_domain.h"
#include "transfer/far_field.h"
#include "transfer/nodal_mixed_discretisation.h"
#include "transfer/nodes.h"
#include "transfer/resting.h"
#include "transfer/supports.h"

namespace mpm::model
{
/// How the stresses of a cell become forces at its nodes (14).
enum class Integration
{
  particles,  ///< the sum over its particles: the material point method as it is
  mixed,      ///< a full cell integrates the mean stress of its particles over its volume; others as above
  dual_domain ///< gradients that are continuous over the sides of cells; see transfer/dual_domain.h
};

/// Mean of the velocity gradient over the cells that share a node; plain doubles.
template <int D>
struct MeanGradient
{
  double volume;
  Matrix<D> gradient;
};

/// Mass of a node; plain doubles.
struct NodeMass
{
  double own;  ///< (11) [kg]
  double even; ///< if the particles filled their cells evenly [kg]
};

/// How a cell gives way to a pressure that its nodes do not feel; see `relax_pressures`.
template <int D>
struct RelaxingCell
{
  double compliance;                 ///< 1 / M [1/Pa]; not positive where the cell takes no part
  double strain;                     ///< volumetric, of the step
  double pressure;                   ///< total, mean of its particles [Pa]
  Vector<D> centre;                  ///< of mass of its particles
  std::array<double, D + 1> weights; ///< of the means of its nodes in the linear prediction of its pressure
};

/// Integration over cells, and what it needs where it is not the sum over particles.
template <int D>
struct CellIntegration
{
  Integration kind = Integration::particles; ///< of the run under way
  /// By law: fraction of nodal mixed discretisation in a cell with its soil alone, of its strains and, by their
  /// transpose, of its forces. Empty where strains are averaged in full, and forces not.
  std::vector<double> averaged_by_law;
  /// Strains are averaged in full wherever forces are averaged, by whatever fraction.
  bool strains_in_full = false;
  std::vector<double> averaged_of_cell; ///< per owned cell: the fraction of averaging; empty where it is one everywhere
  std::vector<int> group_by_law;        ///< group in which the cells of a soil are averaged; -1 outside of the field
  int n_groups = 1;                     ///< of its soils
  AveragedGroups groups;                ///< of the cells in this step
  bool given = false;                   ///< whether the fractions and groups of cells are those of another field
  std::vector<RelaxingCell<D>> relaxing;       ///< per owned cell, in explicit steps of undrained soil; else empty
  std::vector<NodeMass> masses;                ///< scratch, per node
  std::vector<VolumeMean> mean_stress_of_cell; ///< scratch: integral and volume
  std::vector<std::array<double, 2>> fills;    ///< per node: volumes of particles and of cells around it
  std::vector<unsigned char> whole; ///< per owned cell, at the step's start: 1 where full; not with particles
  std::vector<DualStress<D>> dual_cells, dual_nodes; ///< with dual domains, as are the mean gradients of nodes
  std::vector<MeanGradient<D>> mean_gradients;
};

/// The particles of some laws move with one velocity field: with one velocity per node, its own masses, forces and
/// boundary conditions. Fields of the same mesh do not see each other.
template <class G, int D = G::dim>
struct VelocityField
{
  // Where it lives
  MeshPart part;             ///< cells where its particles are, or have been since the last sort, and their nodes
  bool part_shrinks = false; ///< cells that have become empty are to be left out
  std::vector<Index> left;   ///< cells that some particle has left in this pass

  // From its particles
  Array<CellMoments<G>> moments;       ///< of the particles as they are now; zero outside of `part`
  Array<TractionMoments<D>> tractions; ///< likewise; empty where no particle carries any
  Array<NodeSums<D>> nodes;
  RestingCells<D> resting; ///< the cells without particles of their own
  CellIntegration<D> integration;
  std::vector<Vector<D>> contact_force; ///< of rigid surfaces, before it is added to the tractions; else zero
  std::vector<Vector<D>> damping_force; ///< of Rayleigh damping, likewise; else empty
  double least_mass = 0;                ///< nodes below this mass are not moved [kg]
  std::vector<double> per_mass;         ///< 1 / m_i of this step; zero at nodes that are not moved
  bool has_light_nodes = false;         ///< whether a cell with particles may have one in this explicit step

  // How its nodes move
  std::vector<Support<D>> supports;          ///< its boundary conditions
  std::vector<Vector<D>> imposed;            ///< per support: what it changed of the velocity that was found last
  std::vector<DashpotNode<D>> dashpots;      ///< of its absorbing sides, by rising node
  MeshPart beside_dashpots;                  ///< in explicit runs: cells with particles beside them, and their nodes
  IncomingWave<D> incoming;                  ///< through them
  std::vector<FreeField<D>> free_fields;     ///< beside them
  FarField<D> far_field;                     ///< elastic ground beyond a border; in implicit steps
  std::vector<Vector<D>> start_velocity;     ///< v_i at the start of the step
  std::vector<Vector<D>> acceleration;       ///< a_i
  std::vector<Vector<D>> velocity_change;    ///< of the nodes, as the particles take it
  std::vector<Vector<D>> velocity;           ///< v_i that moves and strains the particles
  std::vector<VolumeMean> volumetric_strain; ///< per node and group of soils; empty until first used, with nodal mixed
                                             ///< discretisation
  std::vector<VolumeMean> mean_stress;       ///< likewise
};
} // namespace mpm::model
