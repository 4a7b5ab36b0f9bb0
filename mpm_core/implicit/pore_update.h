#pragma once
/// @file
/// The pore water of the particles at the end of an implicit step.

#include "implicit/step.h"
#include "model/model.h"

namespace mpm::implicit
{
/// Whether the masses of particles follow the water in their pores: not where small displacements leave all pores as
/// they are and full.
bool changes_masses(const PoreWater& water, const ImplicitOptions& options);

/// Adds the increments of pressure to the particles, with what they store in the water, n V p dp / K_w, gives them the
/// gradient at the end, and lets porosity follow the volume (grains do not change theirs) and, where the model says so,
/// conductivity the porosity. Masses follow the water that the pores hold, and where soil may dry its saturation the
/// pressure.
/// @pre particles are where they were at the step's start
template <class G>
void update_pore_water(Model<G>& model, const ImplicitStep<G>& step);

/// Adds what entered in the step at the nodes of this rank with a prescribed pressure, less what left at the free
/// surface, and the works of the flow q over the step: of the pressures where water enters and of the water's weight,
/// sum p Q + sum V q . rho_w (g - a), to the external work, and what the drag takes out, sum V q^2 gamma_w / k.
///
/// With the work of the soil these are an identity: the balance of the water, times the pressures at the end.
template <class G>
void add_flow(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
              std::span<const unsigned char> owned, PoreWater& water, Totals& totals);
} // namespace mpm::implicit
