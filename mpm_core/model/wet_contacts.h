#pragma once
/// @file
/// Rigid surfaces beside soil whose water has a velocity of its own.
///
/// They let no water pass and carry the total stress. Of the force on a particle along the normal, the water carries
/// p / (p + sigma_n'): it acts on the water as the pore pressures in the cell do, and only the rest causes friction
/// (Terzaghi 1936). Forces of contact act on the nodes of cells, so that cells beside a surface feel only a part of
/// them (docs/contact.md); p and sigma_n' then have the same part. Both are means over the cells around the nodes of
/// the particle's cell: what the water carries determines p there, so that by stresses of its own a cell that is hardly
/// filled would end with all of the force in the water, or with none.

#include "model/model.h"

namespace mpm::model
{
/// Adds the forces of all contacts to the tractions at the nodes, over all ranks: the whole of them to those of the
/// soil, and what the water carries to those of the water (see `find_phase_accelerations`). Closes the nodes of the
/// soil's surface that rigid surfaces cover, along their normals: also between particles that touch them.
/// @pre sums and start velocities of the nodes are there
/// @note Collective where there are contacts
template <class G>
void add_wet_contact_forces(Model<G>& model, double dt);
} // namespace mpm::model
