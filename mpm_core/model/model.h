#pragma once
/// @file
/// All that a run consists of, as plain data: mesh, particles, laws, loads, supports, and the room that steps work in.

#include "base/phases.h"
#include "materials/laws/law.h"
#include "model/energy.h"
#include "parallel/far_search.h"
#include "parallel/migration.h"
#include "transfer/dual_domain.h"
#include "transfer/kinematics.h"
#include "transfer/mixed_discretisation.h"
#include "transfer/nodes.h"
#include "transfer/supports.h"

#include <optional>

namespace mpm
{
/// Longest run of particles, and so the batch that a law is given: its scratch stays in the first-level cache.
inline constexpr Index batch_size = 256;

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

/// What stops a run, with its place.
template <int D>
struct Trouble
{
  enum class Kind
  {
    left_mesh,
    not_finite,
    law_failed,
    law_failed_in_parts, ///< also when the strain increment was cut
    lost_volume
  };
  Kind kind;
  Index material;
  GlobalIndex particle;
  Vector<D> position;
  Vector<D> velocity;
  SymTensor<D> strain_increment;
};

/// Sums over this rank since the model was made. Energies in J (J/m in plane strain).
struct Totals
{
  std::int64_t steps = 0;
  std::int64_t particle_steps = 0;
  std::int64_t sorts = 0;
  std::int64_t outflow_particles = 0;
  double outflow_mass = 0;
  double external_work = 0; ///< of gravity and tractions
  double internal_work = 0; ///< of stresses
  double damping_work = 0;  ///< taken out by local damping
  double support_work = 0;  ///< of prescribed velocities
};

/// Of the last step, on this rank.
struct LastStep
{
  double dt = 0;            ///< [s]
  std::int64_t plastic = 0; ///< particles that yielded
};

/// All particles that there have been, over all ranks: those of the model and those that flowed out.
struct Inventory
{
  double particles = 0;
  double mass = 0; ///< [kg]
};

/// Room that steps work in; valid between steps only as far as said.
template <int D>
struct Workspace
{
  bool ready = false;                    ///< runs and moments agree with the particles
  std::vector<Run> runs;                 ///< of the particles as they are now
  std::vector<unsigned char> cell_marks; ///< room, one per cell; all zero
  Array<CellMoments<D>> moments;         ///< of the particles as they are now; zero outside of `soil`
  Array<TractionMoments<D>> tractions;   ///< likewise; empty where no particle carries any
  MeshPart soil;                         ///< where particles are, or have been since the last sort
  bool soil_shrinks = false;             ///< cells that have become empty are to be left out
  Array<NodeSums<D>> nodes;
  std::vector<Vector<D>> start_velocity;             ///< v_i at the start of the step
  std::vector<Vector<D>> acceleration;               ///< a_i
  std::vector<Vector<D>> velocity_change;            ///< of the nodes, as the particles take it
  std::vector<Vector<D>> velocity;                   ///< v_i that moves and strains the particles
  std::vector<VolumetricStrain> volumetric_strain;   ///< of the nodes; used with nodal mixed discretisation
  std::vector<DualStress<D>> dual_cells, dual_nodes; ///< used with dual domains, as are the mean gradients of nodes
  std::vector<MeanGradient<D>> mean_gradients;
  std::vector<std::array<double, 2>> fills; ///< per node: volumes of particles and of cells around it
  std::vector<unsigned char> whole;         ///< per owned cell, at the step's start: 1 where full; not with particles
  std::vector<Index> strayed;               ///< particles that entered another cell of this rank in this pass
  std::vector<Index> left;                  ///< cells that some particle left in this pass
  std::vector<Leaver> leavers;
  std::vector<Index> outflow;
  std::vector<Index> lost;       ///< particles that no cell known to this rank's neighbourhood holds
  std::vector<int> far_partners; ///< ranks beyond the neighbours that exchange particles after this pass
  std::unordered_map<GlobalIndex, Index> owned_cells;
  std::optional<Trouble<D>> trouble;
  double least_mass = 0;        ///< nodes below this mass are not moved [kg]
  Index strays = 0;             ///< particles that changed cell since the last sort
  std::int64_t stray_steps = 0; ///< their sum over the steps since
};

template <int D>
struct Model
{
  Mesh<D> mesh;
  NodeExchange exchange;
  Particles<D> particles;
  std::vector<Law> laws;
  std::vector<Support<D>> supports;
  std::vector<Index> outflow_tags;
  Integration integration = Integration::particles; ///< of the run under way
  Vector<D> gravity{};                              ///< [m/s2]
  double gravity_ramp = 0;                          ///< time over which gravity rises from zero [s]
  double time = 0;                                  ///< [s]
  Totals totals;
  EnergyBook energy;
  PhaseSeconds phase_seconds{}; ///< of the explicit steps on this rank since the model was made
  Inventory inventory;          ///< when the particles were last changed by anything but a step
  LastStep last;
  Workspace<D> work;
};

/// Gravity at a time, with its ramp.
template <int D>
inline Vector<D> gravity_at(const Model<D>& model, double time)
{
  Vector<D> g = model.gravity;
  if (time < model.gravity_ramp)
    for (double& component : g)
      component *= time / model.gravity_ramp;
  return g;
}

/// Gravity at the model's time.
template <int D>
inline Vector<D> current_gravity(const Model<D>& model)
{
  return gravity_at(model, model.time);
}

/// Sorts the particles, gathers runs and moments, and gives nodes the sums and velocities at the start; needed after
/// anything but a step has changed the particles. Does nothing when they are up to date.
/// @throws InputError a particle whose values are not finite, or whose mass or volume is not positive
/// @note Collective
template <int D>
void prepare(Model<D>& model);

/// Trouble with a particle.
template <int D>
Trouble<D> trouble_with(const Model<D>& model, typename Trouble<D>::Kind kind, Index particle,
                        const SymTensor<D>& strain_increment);

/// Notes what stops the run and where, unless something was noted before.
template <int D>
void note_trouble(Model<D>& model, typename Trouble<D>::Kind kind, Index particle,
                  const SymTensor<D>& strain_increment);

/// The trouble of the lowest rank that has one, on all ranks.
/// @note Collective
template <int D>
std::optional<Trouble<D>> shared_trouble(const NodeExchange& exchange, const std::optional<Trouble<D>>& own);

/// Settles with all ranks what became of the particles in `work.lost`: they are in a cell of some rank and leave for
/// it, went through an outflow facet, or are trouble. Then makes `work.trouble` known to all: that of the lowest rank
/// that has one.
/// @note Collective
template <int D>
void agree_on_trouble(Model<D>& model);

/// The particles on all ranks, those that flowed out included.
/// @note Collective
template <int D>
Inventory taken_inventory(const Model<D>& model);

/// Puts the particles back in cell order and finds their runs.
template <int D>
void sort_particles(Model<D>& model);

/// Finds the runs of the particles as they are now, and which of them are the first ones in their cells. Cells that the
/// last particle has left get moments of exactly zero.
/// @param again  the order of the particles is as before, and only those of scattered runs have changed cells
template <int D>
void find_cell_runs(Model<D>& model, bool again);

/// Leaves out of `work.soil` the cells that have become empty, if it is to shrink.
template <int D>
void shrink_soil(Model<D>& model);
} // namespace mpm
