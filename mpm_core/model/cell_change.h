#pragma once
/// @file
/// Particles that change cells or ranks, and the moments of the cells that they leave and enter.

#include "model/model.h"

namespace mpm::model
{
/// Adds the tractions of particles to the moments of their cell, where a field has any.
template <class G, int D = G::dim>
inline void add_tractions(const Particles<D>& particles, const CellShape<D>& shape, Index first, Index last, Index cell,
                          VelocityField<G>& field)
{
  if (!field.tractions.empty())
    add_moments(particles, first, last, shape, field.tractions[cell]);
}

/// Takes out of a cell's moments the particles of a run that have left it, and notes where they went.
template <class G>
void follow_leaving(Model<G>& model, const Run& run, VelocityField<G>& field);

/// Adds particles that came into cells of this rank, from its own cells or from other ranks, to their moments.
/// @param fields  of the model; `field_of_law` says which of them moves the particles of a law
template <class G, int D = G::dim>
void add_entered(const Mesh<D>& mesh, const Particles<D>& particles, std::span<const Index> entered,
                 std::span<const Index> field_of_law, std::vector<VelocityField<G>>& fields);

/// Notes the resting cells that particles have entered.
template <class G>
void note_disturbed(Model<G>& model, std::span<const Index> entered);

/// Takes outflow particles out, sends migrating ones to their ranks and adds arrivals to moments; sorts when order has
/// been lost. Resting cells that particles have entered become particles.
/// @note Collective
template <class G>
void migrate_particles(Model<G>& model);
} // namespace mpm::model
