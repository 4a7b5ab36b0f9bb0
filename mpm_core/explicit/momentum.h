#pragma once
/// @file
/// The momentum balance of the nodes of a velocity field in an explicit step, and the work done.

#include "model/model.h"

namespace mpm::explicit_scheme
{
/// a_i = (f_ext - f_int - D)_i / m_i, with boundary conditions; D_i = alpha |R_i| sign(v_i) per component,
/// R = f_ext - f_int.
/// @pre find_start_velocity has been called in this step
template <class G>
void find_acceleration(const Vector<G::dim>& gravity, double damping, double dt, VelocityField<G>& field);

/// v_i = v_i at the start + dt a_i
template <class G>
void find_advanced_velocity(double dt, VelocityField<G>& field);

/// v_i from `velocity`, the momentum by which the nodes change that of the particles, and the FLIP fraction of the
/// momentum of the step's start; with boundary conditions.
template <class G>
void find_mapped_velocity(double flip_fraction, VelocityField<G>& field);

/// Work done in the step, added to totals. Forces act at the step's start, so their displacement is the mean of the one
/// before and the one after: the energy balance of the leap-frog scheme.
/// @param owned  per node: 1 on exactly one of the ranks that share it
/// @returns work of the internal forces over the step by the velocities at its end
template <class G>
double add_work(const VelocityField<G>& field, std::span<const unsigned char> owned, const Vector<G::dim>& gravity,
                double damping, double dt, Totals& totals);

/// Books the work that moves the nodes, of which an affine transfer loses what the kinetic energy does not gain by the
/// end of the run.
template <class G>
void add_transfer_work(const VelocityField<G>& field, std::span<const unsigned char> owned, double dt,
                       EnergyBook& book);
} // namespace mpm::explicit_scheme
