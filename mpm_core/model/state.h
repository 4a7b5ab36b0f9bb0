#pragma once
/// @file
/// What a run's state holds beside its particles, as tables of numbers.

#include "base/table.h"
#include "model/model.h"

namespace mpm::model
{
/// Numbers that each rank has one of: time, totals, and what decides when particles are sorted.
/// @post each table has one row
template <class G, int D = G::dim>
std::vector<Table> rank_state(const Model<G>& model);

/// Sums over the filled cells of this rank, as they were summed: summed again over the particles they would differ in
/// their last bits, and a run that goes on with them would be another one. The first number of a row is the cell over
/// all ranks.
/// @pre prepare(model) has been called
template <class G, int D = G::dim>
std::vector<Table> cell_state(const Model<G>& model);

/// The tables that `cell_state` may give, without rows.
template <class G, int D = G::dim>
std::vector<Table> empty_cell_state(const Model<G>& model);

/// Puts particles and state of a run into the model, as they were on the same rank; the next step is then the same to
/// the last bit.
/// @note Collective
template <class G, int D = G::dim>
void restore_same(Model<G>& model, Particles<D>&& particles, const std::vector<Table>& ranks,
                  const std::vector<Table>& cells);

/// The same from a run on another partition.
/// @param ranks  a row for each rank of that run
/// @note Collective
template <class G, int D = G::dim>
void restore_other(Model<G>& model, Particles<D>&& particles, const std::vector<Table>& ranks);
} // namespace mpm::model
