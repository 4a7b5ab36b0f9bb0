#pragma once
/// @file
/// Values of particles as nodal mixed discretisation sees them.

#include "model/model.h"

#include <span>

namespace mpm::model
{
/// Averages values of the particles over nodes as nodal mixed discretisation averages strains and forces, in full: by
/// volumes, in each field and soil by itself. What this takes out, such as an alternation from cell to cell, does no
/// work.
/// @param values  of the particles of this rank, in their present order
/// @returns the mean of the values at the nodes of each particle's cell
/// @note Collective
template <class G>
std::vector<double> averaged_over_nodes(Model<G>& model, std::span<const double> values);
} // namespace mpm::model
