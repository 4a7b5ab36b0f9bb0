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

/// Critical time step under damping, from that without.
///
/// The symplectic Euler scheme takes the damping of the velocity at a step's start. It is stable as long as
/// 2 dt c + dt^2 k <= 4 for all motions of unit mass, with the damping c <= alpha + beta k_s and the stiffnesses
/// k <= (2 / critical)^2 of all and k_s <= (2 / critical_of_soil)^2 of the part that damps.
/// @param critical  without damping [s]
/// @param critical_of_soil  of the stresses and the mass of the soil alone [s]; where its water does not move by itself
///                          `critical`, and the step is 2 (sqrt(1 + xi^2) - xi) / omega, with xi the ratio at the
///                          frequency omega = 2 / critical
double damped_time_step(const Rayleigh& rayleigh, double critical, double critical_of_soil);

/// Adds the forces - alpha m_i v_i - sum V_c beta (lambda tr(d) 1 + 2 mu d) grad N_i, with the strain rate d of the
/// velocities at the start, to the tractions at the nodes of a field. With nodal mixed discretisation the rates and the
/// forces are averaged as those of the elastic stresses are: otherwise isochoric motion would be damped as in cells
/// that lock, by the stiffness of the water where soil is undrained.
///
/// Water that has a velocity of its own gets - alpha m_w,i v_i, with the velocity of the soil: the same force per mass
/// as the soil, as if by gravity. Thus undrained soil slows down as one mass, and damping neither drives nor resists
/// the flow of water through the soil; by the water's own velocity it would add alpha m_w to the drag c of Darcy's law.
/// The work of - alpha (m_s v + m_w w) v and - c (w - v)^2 together is never positive as long as c >= alpha m_w^2 / 4
/// (m_s + m_w), that is, alpha <= 4 g rho / (k rho_w), which is 78 1/s for k = 1 m/s.
/// @pre nodes have the sums of all ranks, and velocities at the start
/// @post the tractions of the soil have the forces on both phases, those on the water are in its `damping_force`
/// @note Collective
template <class G>
void add_rayleigh_forces(Model<G>& model, const Rayleigh& rayleigh, VelocityField<G>& field);

/// Counts the work of these forces in a step as work of damping, not of external forces.
template <class G>
void note_rayleigh_work(std::span<const unsigned char> owned, double dt, const VelocityField<G>& field, Totals& totals);
} // namespace mpm::model
