#pragma once
/// @file
/// The implicit scheme: start, trial, residual, tangent, accept; docs/implicit.md has the equations (I1) to (I5).
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
///
/// Each force of the residual is a term in a file of its own, with two functions: one adds this rank's part of its
/// forces at nodes, the other its blocks to the tangent.

#include "implicit/entries.h"

namespace mpm::implicit
{
/// Begins a step of length dt [s]: maps the particles to the nodes, takes v0 (dynamic) or rest (quasi-static), under
/// the supports, as first iterate.
/// @throws InputError a model of several velocity fields
/// @note Collective
template <class G>
void start_step(Model<G>& model, ImplicitStep<G>& step, const ImplicitOptions& options, double dt);

/// Begins the second stage of a step of second order, after the first one has been solved.
/// @pre `find_residual` was called for the solution of the first stage
template <class G>
void start_second_stage(Model<G>& model, ImplicitStep<G>& step);

/// Residual of the iterate `field.velocity` (I2), and the tangents of the cells when wanted.
/// @note Collective
template <class G>
TrialReport find_residual(Model<G>& model, ImplicitStep<G>& step, bool tangents);

/// Matrices of the tangent: J = K, with nodal mixed discretisation K + K_p G, and where mean stresses are averaged too
/// K + K_p G + G^T (L + H G).
struct TangentEntries
{
  BlockEntries stiffness;             ///< K = d (f_int + ghost penalty + inertia) / du at constant averaged strain
  BlockEntries volumetric_force;      ///< K_p
  BlockEntries volumetric_strain;     ///< G
  BlockEntries mean_stress;           ///< L
  BlockEntries mean_stress_by_strain; ///< H
};

/// The tangent of the residual (I4).
/// @pre the step's tangents belong to the iterate
/// @post the order of the entries is always the same for the same system, as long as `tangent` is not emptied
template <class G, int D = G::dim>
void find_tangent(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                  const ImplicitSystem<D>& system, TangentEntries& tangent);

/// Accepts the iterate: moves and strains the particles (I5), adds to the totals.
/// @pre `find_residual` was called for the iterate, so that the work of its forces is known
/// @returns whether it could; otherwise `model.failure` says why, and the particles are as they were at the step's
/// start
/// @note Collective
template <class G>
bool accept_step(Model<G>& model, const ImplicitStep<G>& step);
} // namespace mpm::implicit
