#pragma once
/// @file
/// Transient relaxation (21)-(24): the root of an implicit step by pseudo-time iteration on the nodes, without a
/// matrix.
///
///     M_TR (v_{n+1} - v_n) = r(v_n)      (21)
///     u_{n+1} = u_n + (v_{n+1} - v_n) dt (22)
///
/// (23) and (24) make M_TR from a density per element, so that all elements share one pseudo-step. Read literally they
/// are too light. With J = -dr/dv the iteration is stable where 2 M_TR - J is positive, which in one dimension asks for
///
///     rho_TR >= 2 dt rho (c_d/h)^2 + rho/(2 dt).
///
/// The row sums of an element's stiffness give the same there and a bound on any simplex, also where Poisson's ratio
/// makes it stiffer than c_d says. They are those of the mesh, filled or not.
///
/// The other kinds follow second-order dynamics in pseudo-time, M_DR dw = r, dv = w, which is stable where 4 M_DR - J
/// is positive. All reach the same root.

#include "implicit/implicit_step.h"

namespace mpm::implicit
{
enum class RelaxationKind
{
  richardson, ///< (21) as it is
  local,      ///< second order, local damping beta |r| sign(w); M_DR is larger by 1 + beta
  kinetic,    ///< second order, w set to zero where the body has passed a peak of its kinetic energy, sum w r < 0
  viscous     ///< second order, viscous damping critical for the lowest mode by Rayleigh's quotient (Underwood 1983)
};

/// A relaxation under way.
template <int D>
struct Relaxation
{
  RelaxationKind kind;
  std::vector<double> mass;    ///< M_TR or M_DR of each node
  std::vector<Vector<D>> rate; ///< w
  std::vector<Vector<D>> last; ///< residual of the iterate before
  TrialReport report;          ///< of the iterate
};

/// Begins at the step's present iterate.
/// @note Collective
template <class G, int D = G::dim>
Relaxation<D> start_relaxation(Model<G>& model, ImplicitStep<G>& step, RelaxationKind kind);

/// Iterates until |r| is not above `tolerance` times the scale of the forces, a trial fails, or `most` iterations are
/// done.
/// @returns iterations done
/// @note Collective
template <class G, int D = G::dim>
int relax(Model<G>& model, ImplicitStep<G>& step, Relaxation<D>& relaxation, double tolerance, int most);
} // namespace mpm::implicit
