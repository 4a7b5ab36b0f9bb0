#pragma once
/// @file
/// Nodal mixed discretisation (NMD): the remedy of Detournay & Dzik against the locking of linear simplices.

#include "parallel/node_exchange.h"

#include <span>

namespace mpm
{
/// Room for the nodal averages: per node sum theta_c V_c and sum V_c.
using VolumetricSums = std::vector<std::array<double, 2>>;

/// Replaces the volumetric strain of each filled cell by the mean of its nodes' values, which are the averages over the
/// filled cells around them, weighted by filled volume (method of Detournay & Dzik 2006; volume weights keep the
/// tangent symmetric).
/// @param volume  filled volume per owned cell; 0 where empty
/// @param theta   volumetric strain per owned cell, changed in place
/// @note Collective
template <int D>
void average_volumetric_strain(const Mesh<D>& mesh, std::span<const double> volume, NodeExchange& exchange,
                               VolumetricSums& sums, std::span<double> theta);
} // namespace mpm
