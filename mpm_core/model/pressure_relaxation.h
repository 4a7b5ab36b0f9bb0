#pragma once
/// @file
/// Pressures of undrained soil that no node feels, and how its cells give way to them.
///
/// Nodal mixed discretisation leaves pressures that nodes do not feel: those that alternate from cell to cell, and
/// along a fixed boundary, which has pressures but no velocities (linear velocities with one pressure per node are not
/// stable). Soil that is sheared while it moves through the mesh collects them, the more the stiffer its water is. They
/// do no work, but the effective stresses take part in the volumetric strains behind them, and where these vary by more
/// than their mean, soil without tensile strength has more of it on the whole: liquefied soil that flows would regain
/// strength by chance.
///
/// So the cells give way to them as they are sheared. With the total pressure P of the cells and their prediction B P,
/// which is linear between the means of the nodes and exact for a linear P, a cell expands in a step by
///
///     theta = L^T phi M^-1 L P,  L = 1 - B,  phi = 1 - exp(-c d gamma),
///
/// where M is its undrained modulus, d gamma its shear strain and L^T the transpose with the volumes of the cells as
/// weights. So the soil's volume does not change, energy is only taken out, and soil at rest remains as it is. Terms of
/// this kind stabilise pressures by projection (Dohrmann and Bochev 2004, Int. J. Numer. Meth. Fluids 46; in the
/// material point method Zhao and Choo 2020, Comput. Methods Appl. Mech. Engrg. 362), there at all times.

#include "model/model.h"

#include <cstdint>

namespace mpm::model
{
/// c, so that such a pressure fades while its soil is sheared by a hundredth.
inline constexpr double relaxed_per_shear_strain = 100;

/// The largest phi, so that the sum over cells that share nodes is stable.
inline constexpr double most_relaxed = 0.5;

/// Cells give way in one of so many steps, for all of them.
inline constexpr std::int64_t relaxation_interval = 5;

/// Finds the strains of the cells of undrained soil, and of soil with water that moves by itself, for
/// `averaged_strain`.
/// @param dt  of the step [s]
/// @pre average_strains has been called for the step, and the moments are those of its start
/// @note Collective
template <class G>
void relax_pressures(Model<G>& model, double dt, VelocityField<G>& field);
} // namespace mpm::model
