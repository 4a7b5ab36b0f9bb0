#pragma once
/// @file
/// The pass of an explicit step over the water of the particles.

#include "model/model.h"

namespace mpm::model
{
/// Gives the water of the particles its velocity w_p += sum N_i dt a_i, the mass that has not flowed away, and pores
/// that take up the change of volume of the soil, as grains do not change theirs. Their pressure follows:
///
///     m_w -= V dt div j,  n V += V dt div v,  p = K_w (m_w / (rho_w n V) - 1),
///
/// First the water of a cell spreads over its pores, with its momentum: particles that came from other cells
/// would keep pressures of their own, whose sum alone acts on the nodes. The above is (n / K_w) dp/dt = -div v - div (n
/// (w - v)) for small p / K_w; it is no lower than the limit of suction.
/// @param flip_fraction  of the water's own velocity that is kept
/// @param nmd            take the means of `average_strains` and `average_outflow`
/// @pre particles are where they were at the step's start
/// @returns work of the pore pressures on the soil and on the flow: half with those of the start, half with those of
/// the end
/// @post model.failure where pores have closed
template <class G>
std::array<double, 2> water_pass(Model<G>& model, double dt, double flip_fraction, bool nmd);
} // namespace mpm::model
