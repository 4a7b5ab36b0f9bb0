#pragma once
/// @file
/// The implicit scheme: a step under way, its residual, and its end.
///
/// Backward Euler solves
///
///     r(v1) = f_ext - f_int(u) - D - M (v1 - v0) / dt = 0,   u = dt v1.
///
/// The scheme of second order is the diagonally implicit Runge-Kutta method of two stages with g = 1 - 1/sqrt(2)
/// (Alexander 1977, SIAM J. Numer. Anal. 14, 1006-1021, theorem 5), each stage like a step of backward Euler of length
/// g dt:
///
///     M (v1 - v0) / (g dt) = f(u1),                        u1 = g dt v1
///     M (v2 - v0 - (1 - g)/g (v1 - v0)) / (g dt) = f(u2),  u2 = (1 - g) dt v1 + g dt v2,
///
/// with f = f_ext - f_int - D; the step ends with u2 and v2. It is L-stable: oscillations that the step does not
/// resolve go, while of the energy of one of angular frequency w a step leaves (1 + 2 z) / (1 + z)^2, z = (g w dt)^2,
/// that is 1 - z^2 where it is resolved (backward Euler: 1 / (1 + (w dt)^2)). Stresses go from the step's start over
/// the whole increment in both stages.
///
/// Stresses go from the step's start over the whole increment u; gradients and volumes are those of the start, so that
/// the first quasi-static step of a linear elastic body whose cells are filled is the solution of linear finite
/// elements. A trial leaves the particles as they are: only sums over cells are kept of it.

#include "implicit/ghost.h"
#include "implicit/inertia.h"
#include "transfer/cell_strain.h"

#include <limits>

namespace mpm
{
struct ImplicitOptions
{
  double damping = 0; ///< local damping alpha, in [0, 1), see implicit_inertia.h; not used in quasi-static steps
  double pic = 0;     ///< PIC share of a critical time step, in [0, 1]
  bool mixed_discretisation = false;
  bool average_stress = false; ///< with nodal mixed discretisation: forces of averaged mean stresses, see mapping.h
  Integration integration = Integration::particles; ///< by particles or mixed
  GhostOptions ghost;                               ///< of the remedy for nodes with hardly any mass
  bool second_order = false;                        ///< two stages instead of backward Euler; with inertia only
  bool quasi_static = false;                        ///< no inertia: f_ext - f_int(u) = 0; particles end at rest
  bool hold_positions = false; ///< small displacements: only stresses change, not places and volumes; quasi-static
  bool at_rest = false;        ///< laws are given all time, however long the step: stresses above the strength relax
  double load_share = 1; ///< of f_ext - f_int at the step's start that the step applies; below 1 where quasi-static
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
  std::int64_t plastic = 0; ///< particles that yield
  std::int64_t failed = 0;  ///< particles whose law failed, and cells that would lose their volume
};

/// What the cells of a trial give a node [N], summed over ranks.
template <int D>
struct TrialForces
{
  Vector<D> internal; ///< f_int (14)
  Vector<D> ghost;    ///< of the ghost penalty
};

/// Forces on a node, means over the stages of a step [N].
template <int D>
struct MeanForces
{
  Vector<D> external, internal, ghost, inertia;
};

/// What a stage has of the ones before it. The iterate v is the mean velocity over the step so far, u / dt; that of the
/// stage's end is (v - carried) / weight.
template <int D>
struct Stage
{
  double dt;                         ///< of the stage, over which inertia acts [s]
  double weight = 1;                 ///< of its forces in the step
  std::vector<Vector<D>> start;      ///< velocity from which it begins
  std::vector<Vector<D>> carried;    ///< empty where there was no stage before
  std::vector<MeanForces<D>> before; ///< forces of the stages before, weighted; likewise
};

/// A step under way. The iterate is `velocity` of the velocity field, f_int is in its `nodes` too.
template <class G, int D = G::dim>
struct ImplicitStep
{
  ImplicitOptions options;
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
  std::vector<TrialForces<D>> forces;
  std::vector<GhostFacet<D>> ghosts; ///< stabilised facets
  Halos halos;                       ///< of the mesh, for those between ranks; made by the first step
  bool halos_ready = false;
  std::vector<double> frequency;     ///< of each node's elastic oscillations [rad/s]; where damping acts
  std::optional<Failure<D>> failure; ///< of the last trial, where it failed
  std::vector<unsigned char> active; ///< per node: 1 where a filled cell touches it
};

/// Duration that laws are given [s]
template <class G>
double law_dt(const ImplicitStep<G>& step)
{
  return step.options.at_rest ? std::numeric_limits<double>::infinity() : step.dt;
}

/// Begins a step of length dt [s]: maps the particles to the nodes, takes v0 (dynamic) or rest (quasi-static), under
/// the supports, as first iterate.
/// @note Collective
template <class G, int D = G::dim>
void start_step(Model<G>& model, ImplicitStep<G>& step, const ImplicitOptions& options, double dt);

/// Begins the second stage of a step of second order, after the first one has been solved.
/// @pre `find_residual` was called for the solution of the first stage
template <class G, int D = G::dim>
void start_second_stage(Model<G>& model, ImplicitStep<G>& step);

/// Velocity at the end of the stage for the iterate.
template <class G, int D = G::dim>
inline double end_velocity(const Model<G>& model, const ImplicitStep<G>& step, Index node, int component)
{
  const Stage<D>& stage = step.stage;
  const double carried = stage.carried.empty() ? 0 : stage.carried[node][component];
  return (model.fields.front().velocity[node][component] - carried) / stage.weight;
}

/// Inertia force of one component of a node, damping in it, and its derivative by the iterate; none in a quasi-static
/// step.
template <class G, int D = G::dim>
Inertia inertia_force(const Model<G>& model, const ImplicitStep<G>& step, Index node, int component);

/// The same for given velocities at start and end of the stage.
template <class G, int D = G::dim>
Inertia stage_inertia(const Model<G>& model, const ImplicitStep<G>& step, Index node, double start, double end);

/// What a solved step of second order differs by from one of first order, u2 - dt v1 = g dt (v2 - v1): root mean square
/// over the mass [m]. An estimate of the error of the displacement of a step that errs on the safe side.
/// @note Collective
template <class G, int D = G::dim>
double displacement_error(const Model<G>& model, const ImplicitStep<G>& step);

/// Makes the iterate satisfy the supports.
template <class G, int D = G::dim>
void impose_supports(Model<G>& model, const ImplicitStep<G>& step);

/// Residual of the iterate `field.velocity`, and the tangents of the cells when wanted.
/// @note Collective
template <class G, int D = G::dim>
TrialReport find_residual(Model<G>& model, ImplicitStep<G>& step, bool tangents);

/// Ends the step with the iterate: moves and strains the particles, adds to the totals.
/// @pre `find_residual` was called for the iterate, so that the work of its forces is known
/// @returns whether it could; otherwise `model.failure` says why, and the particles are as they were at the step's
/// start
/// @note Collective
template <class G, int D = G::dim>
bool finish_step(Model<G>& model, const ImplicitStep<G>& step);
} // namespace mpm
