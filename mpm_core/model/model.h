#pragma once
/// @file
/// All that a run consists of, as plain data: mesh, particles, laws, loads, and the velocity fields that move them.

#include "base/phases.h"
#include "contact/contact.h"
#include "materials/laws/law.h"
#include "model/energy.h"
#include "model/field_contact.h"
#include "model/member.h"
#include "model/pore_water.h"
#include "model/water_field.h"
#include "parallel/far_search.h"
#include "parallel/migration.h"
#include "transfer/kinematics.h"

#include <algorithm>
#include <optional>

namespace mpm::model
{
/// What stops a run, with its place.
template <int D>
struct Failure
{
  enum class Kind
  {
    left_mesh,
    not_finite,
    law_failed,
    law_failed_in_parts, ///< also when the strain increment was cut
    lost_volume,
    closed_pores
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
  std::int64_t converted_cells = 0;  ///< resting cells that have become particles
  std::int64_t gained_particles = 0; ///< by that, beyond their own rows
  double external_work = 0;          ///< of gravity and tractions
  double internal_work = 0;          ///< of stresses
  double damping_work = 0;           ///< taken out by local damping
  double support_work = 0;           ///< of prescribed velocities
  double drag_work = 0;              ///< taken out by the flow of water through the soil
  double friction_work = 0;          ///< taken out where velocity fields touch
};

/// Results of the last step, on this rank.
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

/// The particles of a cell in all of its runs.
struct CellContent
{
  Index particles;
  double mass; ///< [kg]
};

/// The order of the particles by cells.
struct CellOrder
{
  std::vector<Run> runs;             ///< of the particles as they are now, without the rows of resting cells
  std::vector<unsigned char> marks;  ///< scratch, one per cell; all zero
  std::vector<CellContent> contents; ///< scratch, one per cell; of those with particles in an affine transfer
  Index out_of_order = 0;            ///< particles that changed cell since the last sort
  std::int64_t cost = 0;             ///< their sum over the steps since
};

/// What changes cells or ranks in a step.
struct Migration
{
  std::unordered_map<GlobalIndex, Index> owned_cells; ///< local number by that over all ranks
  std::vector<Index> entered;                         ///< particles that entered another cell of this rank
  std::vector<MigratingParticle> migrating;
  std::vector<Index> outflow;
  std::vector<Index> disturbed;  ///< resting cells that a particle has entered in this step
  std::vector<Index> lost;       ///< particles that no cell known to this rank's neighbourhood holds
  std::vector<int> far_partners; ///< ranks beyond the neighbours that exchange particles after this pass
};

/// Of cells that have moved with the body, the mesh as it was; empty when none have. See model/moving_cells.h.
template <int D>
struct MovedCells
{
  std::vector<Vector<D>> initial_points;
  Array<CellShape<D>> initial_shapes;
  std::vector<Index> watched;       ///< nodes at the surface of the body, which may meet the boundary of the mesh
  std::vector<Index> watched_cells; ///< for each of them an owned cell near its place, for the next search
  double travel = 0;                ///< since their places were looked at, over the smallest altitude of a cell
};

template <class G, int D = G::dim>
struct Model
{
  Mesh<D> mesh; ///< with its nodes where they are now
  MovedCells<D> moved_cells;
  NodeExchange exchange;
  Particles<D> particles;
  std::vector<Law> laws;
  std::vector<VelocityField<G>> fields = std::vector<VelocityField<G>>(1);
  std::vector<Index> field_of_law;             ///< number of the velocity field of the particles that follow each law
  std::vector<Contact<D>> contacts;            ///< with rigid surfaces
  std::vector<Collision> collisions;           ///< of rigid bodies among one another
  std::vector<FieldContact<D>> field_contacts; ///< of velocity fields among one another
  std::vector<Member<D>> members;              ///< structural ones, in explicit steps
  std::vector<double> volume_around;           ///< per node, of the cells around it; where there are members [m^D]
  double largest_density = 0;                  ///< of the particles; where there are members [kg/m^D]
  std::optional<PoreWater> water;              ///< in the pores of the soil
  WaterField<G> water_field;                   ///< its motion, where it has its own; see `has_two_phases`
  std::vector<Index> outflow_tags;
  Vector<D> gravity{};     ///< [m/s2]
  double gravity_ramp = 0; ///< time over which gravity rises from zero [s]
  double time = 0;         ///< [s]
  Totals totals;
  EnergyBook energy;
  PhaseSeconds phase_seconds{}; ///< of the explicit steps on this rank since the model was made
  Inventory inventory;          ///< when the particles were last changed by anything but a step
  LastStep last;
  CellOrder order;
  Migration migration;
  std::optional<Failure<D>> failure; ///< what stopped the run, on all ranks after a step
  bool ready = false;                ///< order and velocity fields agree with the particles
};

/// The velocity field that moves the particles of a law.
template <class G>
inline VelocityField<G>& field_of(Model<G>& model, Index material)
{
  return model.fields[static_cast<std::size_t>(model.field_of_law[static_cast<std::size_t>(material)])];
}
template <class G>
inline const VelocityField<G>& field_of(const Model<G>& model, Index material)
{
  return model.fields[static_cast<std::size_t>(model.field_of_law[static_cast<std::size_t>(material)])];
}

/// Whether soil and water have a velocity each.
template <class G>
inline bool has_two_phases(const Model<G>& model)
{
  return model.particles.water_velocity.present;
}

/// Gives the model its laws, with storage for their state variables, and the number of the velocity field of each.
/// @param field_of_law  from 0, without gaps; empty for one field
/// @throws InputError numbers with gaps, or not one for each law
template <class G>
void set_laws(Model<G>& model, std::vector<Law> laws, std::vector<Index> field_of_law = {});

/// Gives all velocity fields these boundary conditions, in the place of those they had.
/// @note Collective
template <class G, int D = G::dim>
void set_supports(Model<G>& model, const std::vector<SupportRequest<D>>& requests)
{
  const auto supports = make_supports<G>(model.mesh, model.exchange, requests);
  for (VelocityField<G>& field : model.fields)
    field.supports = supports;
}

/// Gravity at a time, with its ramp.
template <class G, int D = G::dim>
inline Vector<D> gravity_at(const Model<G>& model, double time)
{
  Vector<D> g = model.gravity;
  if (time < model.gravity_ramp)
    for (double& component : g)
      component *= time / model.gravity_ramp;
  return g;
}

/// Lets the water of a model stand as at a time and weigh as under a gravity [m/s2]; nothing without water.
template <class G>
inline void stand_water(Model<G>& model, double time, const Vector<G::dim>& gravity)
{
  if (!model.water)
    return;
  model.water->time = time;
  model.water->gravity = std::max(0.0, -gravity[G::dim - 1]);
}

/// Sorts the particles, finds runs and moments, and gives nodes the sums and velocities at the start; needed after
/// anything but a step has changed the particles. Does nothing when they are up to date.
/// @throws InputError a particle whose values are not finite, or whose mass or volume is not positive; one in a resting
/// cell
/// @note Collective
template <class G>
void prepare(Model<G>& model);

/// Brings moments of cells up to date with masses of particles that a step has changed, in their order as it is.
/// @note Collective
template <class G>
void take_masses(Model<G>& model);

/// The failure of a particle.
template <int D>
Failure<D> failure_of(const Particles<D>& particles, typename Failure<D>::Kind kind, Index particle,
                      const SymTensor<D>& strain_increment);

/// Notes what stops the run and where, unless something was noted before.
template <int D>
void note_failure(std::optional<Failure<D>>& failure, const Particles<D>& particles, typename Failure<D>::Kind kind,
                  Index particle, const SymTensor<D>& strain_increment);

/// The failure of the lowest rank that has one, on all ranks.
/// @note Collective
template <int D>
std::optional<Failure<D>> shared_failure(const NodeExchange& exchange, const std::optional<Failure<D>>& own);

/// Agrees with all ranks what became of the lost particles: they are in a cell of some rank and migrate to it, went
/// through an outflow facet, or are a failure. Then makes `model.failure` known to all: that of the lowest rank that
/// has one.
/// @note Collective
template <class G>
void agree_on_failure(Model<G>& model);

/// The particles on all ranks, those that flowed out included.
/// @note Collective
template <class G>
Inventory taken_inventory(const Model<G>& model);

/// Puts the particles back in cell order and finds their runs.
template <class G>
void sort_particles(Model<G>& model);

/// Finds the runs of the particles as they are now, and which of them are the first ones of their field in their cells.
/// Cells that the last particle of a field has left get moments of exactly zero.
/// @param again  the order of the particles is as before, and only those of runs out of order have changed cells
template <class G>
void find_cell_runs(Model<G>& model, bool again);
} // namespace mpm::model
