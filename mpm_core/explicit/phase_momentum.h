#pragma once
/// @file
/// The momentum balance of nodes where soil and water move by themselves, and the work done.

#include "model/model.h"

namespace mpm::explicit_scheme
{
/// Accelerations of soil and water over dt from the forces at the step's start and the drag at its end,
///
///     m_s a_s = R_s + c (w - v),  m_w a_w = R_w - c (w - v),  w - v at the end,
///     R_w = m_w g + n P,  R_s = m_s g + t - f_int + (1 - n) P,  P = sum V_p p_p grad N,
///
/// so that drag limits no time step. Local damping acts on both phases alike, by the sum of R_s and R_w: it leaves the
/// flow of water through the soil alone. Where pressure is prescribed on a facet, n of it acts on the water. The
/// tractions t have the forces of Rayleigh damping on both phases, of which the water takes its own, see
/// `add_rayleigh_forces`.
/// @param density  of water [kg/m3]
template <class G>
void find_phase_accelerations(const Vector<G::dim>& gravity, double damping, double dt, double density,
                              VelocityField<G>& soil, WaterField<G>& water);

/// Changes the velocity of the water where that of the soil was prescribed, as that was: what the particles around a
/// fixed node give it is no flow of water past the soil.
/// @pre boundary conditions were imposed on the same velocity of the soil last
template <class G>
void follow_supports(const VelocityField<G>& soil, const VelocityField<G>& water,
                     std::span<Vector<G::dim>> water_velocity);

/// Makes velocities of soil and water agree at impervious sides along their normals, without a change of momentum but
/// where the soil is held.
template <class G>
void close_sides(const VelocityField<G>& soil, const WaterField<G>& water, std::span<Vector<G::dim>> soil_velocity,
                 std::span<Vector<G::dim>> water_velocity);

/// Work done in the step, added to totals; see `add_work`.
/// @param owned  per node: 1 on exactly one of the ranks that share it
template <class G>
void add_phase_work(const VelocityField<G>& soil, const WaterField<G>& water, std::span<const unsigned char> owned,
                    const Vector<G::dim>& gravity, double damping, double dt, double density, Totals& totals);
} // namespace mpm::explicit_scheme
