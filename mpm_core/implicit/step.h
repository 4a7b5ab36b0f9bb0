#pragma once
/// @file
/// An implicit step under way, as plain data.

#include "implicit/contact_step.h"
#include "implicit/ghost_facets.h"
#include "implicit/pore_step.h"
#include "model/material_points.h"
#include "transfer/cell_strain.h"

#include <limits>

namespace mpm::implicit
{
struct ImplicitOptions
{
  double damping = 0;          ///< local damping alpha, in [0, 1), see damped_inertia.h; not used in quasi-static steps
  double mass_damping = 0;     ///< forces against the motion over the momentum [1/s]; not used in quasi-static steps
  double pic = 0;              ///< PIC fraction of a critical time step, in [0, 1]
  bool nmd = false;            ///< nodal mixed discretisation
  bool average_stress = false; ///< with nodal mixed discretisation: forces of averaged mean stresses, see mapping.h
  bool as_elements = false;    ///< of these: averages of strains and forces as those of finite elements
  Integration integration = Integration::particles; ///< by particles or mixed
  GhostOptions ghost;                               ///< of the remedy for nodes with hardly any mass
  bool second_order = false;                        ///< two stages instead of backward Euler; with inertia only
  bool quasi_static = false;                        ///< no inertia: f_ext - f_int(u) = 0; particles end at rest
  bool hold_positions = false;    ///< small displacements: only stresses change, not places and volumes; quasi-static
  bool count_displacement = true; ///< with small displacements: of particles and resting cells, as if they had moved
  bool at_rest = false;           ///< laws are given all time, however long the step: stresses above the strength relax
  double load_fraction = 1; ///< of f_ext - f_int at the step's start that the step applies; below 1 where quasi-static
};

/// Entries of a cell's gradient: du_b/dx_m at b * D + m, then the hoop strain in axial symmetry.
template <class G>
inline constexpr int n_gradient = G::dim* G::dim + (G::has_hoop ? 1 : 0);

/// Derivatives of the gradient's entries by the displacement of vertex l of a cell, one row per component.
template <class G, int D = G::dim>
std::array<std::array<double, n_gradient<G>>, D> gradient_rows(const CellShape<D>& shape, int l)
{
  std::array<std::array<double, n_gradient<G>>, D> rows{};
  for (int b = 0; b < D; ++b)
    for (int m = 0; m < D; ++m)
      rows[b][b * D + m] = shape.gradient[l][m];
  if constexpr (G::has_hoop)
    rows[0][D * D] = hoop_gradient<G>(shape);
  return rows;
}

/// Derivatives of sum V sigma over the particles of a cell.
template <class G>
struct CellTangent
{
  /// by the entries of the gradient; with nodal mixed discretisation at constant volumetric strain
  std::array<std::array<double, n_gradient<G>>, G::n_working> by_gradient;
  /// by the averaged volumetric strain; zero without nodal mixed discretisation
  Working<G> by_volumetric;
  /// Where mean stresses are averaged: of the mean of the normal components, which the above are then
  /// without
  std::array<double, n_gradient<G>> mean_by_gradient;
  double mean_by_volumetric;
};

/// Norms of a residual over all ranks and unsupported directions [N], and what else a trial says.
struct TrialReport
{
  double residual = 0;
  double scale = 0;         ///< largest of |f_ext|, |f_int|, |M (v1 - v0) / dt|, reactions included
  double lost_water = 0;    ///< water out of balance, over that of the pores
  std::int64_t plastic = 0; ///< particles that yield
  std::int64_t failed = 0;  ///< particles whose law failed, and cells that would lose their volume
};

/// Forces on a node [N]; each term of the residual has its own, as their works are counted apart.
template <int D>
struct NodalForces
{
  Vector<D> external; ///< f_ext (15)
  Vector<D> internal; ///< f_int (14), pore pressures included
  Vector<D> ghost;    ///< of the ghost penalty
  Vector<D> inertia;  ///< M (v1 - v0) / dt, with what damping adds to it
};

/// What a stage has of the ones before it. The iterate v is the mean velocity over the step so far, u / dt; that of the
/// stage's end is (v - carried) / weight.
template <int D>
struct Stage
{
  double dt;                          ///< of the stage, over which inertia acts [s]
  double weight = 1;                  ///< of its forces in the step
  std::vector<Vector<D>> start;       ///< velocity from which it begins
  std::vector<Vector<D>> carried;     ///< empty where there was no stage before
  std::vector<NodalForces<D>> before; ///< forces of the stages before, weighted; likewise
};

/// A step under way. The iterate is `velocity` of the velocity field, f_int is in its `nodes` too.
template <class G, int D = G::dim>
struct ImplicitStep
{
  ImplicitOptions options;
  double time = 0;   ///< at the step's start [s]
  double length = 0; ///< of the whole step [s]
  double dt = 0;     ///< from the step's start to the end of the stage [s]
  Stage<D> stage;
  std::vector<Vector<D>> external; ///< f_ext at the step's end
  std::vector<Vector<D>> residual; ///< zero along supported directions
  std::vector<Working<G>> stress;  ///< sum V sigma of each owned cell in the trial
  /// Sum V dsigma/dstrain of each owned cell, of the components that do work; engineering shear
  std::vector<std::array<Working<G>, G::n_working>> stiffness;
  std::vector<CellStrain<D>> strains;   ///< of each owned cell that is filled, in the trial
  std::vector<CellTangent<G>> tangents; ///< of each owned cell
  std::vector<NodalForces<D>> forces;   ///< of the trial, over all ranks
  std::vector<GhostFacet<D>> ghosts;    ///< stabilised facets
  Halos halos;                          ///< of the mesh, for those between ranks; made by the first step
  bool halos_ready = false;
  bool has_contacts = false;         ///< with rigid surfaces, which follow
  ContactStep<D> contact;            ///< with rigid surfaces
  DrivenBodies<D> bodies;            ///< those that forces move
  PoreStep<D> pore;                  ///< flow of the pore water; nothing in it without water
  std::vector<double> elastic;       ///< stiffness of each node, sum V (K + 4G/3) |grad N|^2; this rank's part [N/m]
  std::vector<double> frequency;     ///< of each node's elastic oscillations [rad/s]; where damping acts
  std::optional<Failure<D>> failure; ///< of the last trial, where it failed
  std::vector<Index> cells;          ///< filled cells of this rank
  std::vector<Run> runs;             ///< of particles, and the rows of resting cells
  std::vector<unsigned char> active; ///< per node: 1 where a filled cell touches it
};

/// The particles and resting cells that a step strains.
template <class G, int D = G::dim>
MaterialPoints<D> points_of(const Model<G>& model, const ImplicitStep<G>& step)
{
  return {model.particles, step.runs, model.laws};
}

/// Duration that laws are given [s]
template <class G>
double law_dt(const ImplicitStep<G>& step)
{
  return step.options.at_rest ? std::numeric_limits<double>::infinity() : step.dt;
}

/// Velocity of a node at the end of the stage, for its velocity in the iterate.
template <class G, int D = G::dim>
inline double end_velocity(const ImplicitStep<G>& step, const VelocityField<G>& field, Index node, int component)
{
  const Stage<D>& stage = step.stage;
  const double carried = stage.carried.empty() ? 0 : stage.carried[node][component];
  return (field.velocity[node][component] - carried) / stage.weight;
}
} // namespace mpm::implicit
