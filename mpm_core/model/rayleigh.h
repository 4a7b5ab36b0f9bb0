#pragma once
/// @file
/// Rayleigh damping of soil at small strains: forces in proportion to momentum and to the rate of elastic stress.

#include "model/model.h"

namespace mpm::model
{
struct Rayleigh
{
  double mass = 0;           ///< alpha, of the mass matrix [1/s]
  double stiffness = 0;      ///< beta, of the elastic stiffness matrix [s]
  double plastic_strain = 0; ///< plastic deviatoric strain of a point above which its cell is damped by its law alone
};

/// Critical time step under damping, from that without: the symplectic Euler scheme, which takes the damping of the
/// velocity at a step's start, is stable up to 2 (sqrt(1 + xi^2) - xi) / omega, with xi the ratio at the frequency
/// omega = 2 / critical.
double damped_time_step(const Rayleigh& rayleigh, double critical);

/// Adds the forces - alpha m_i v_i - sum V_c beta (lambda tr(d) 1 + 2 mu d) grad N_i, with the strain rate d of the
/// velocities at the start, to the tractions at the nodes of a field. With nodal mixed discretisation the rates and the
/// forces are averaged as those of the elastic stresses are: otherwise isochoric motion would be damped as in cells
/// that lock, by the stiffness of the water where soil is undrained.
/// @pre nodes have the sums of all ranks, and velocities at the start
/// @note Collective
template <class G>
void add_rayleigh_forces(Model<G>& model, const Rayleigh& rayleigh, VelocityField<G>& field);

/// Counts the work of these forces in a step as work of damping, not of external forces.
template <class G>
void note_rayleigh_work(std::span<const unsigned char> owned, double dt, const VelocityField<G>& field, Totals& totals);
} // namespace mpm::model
