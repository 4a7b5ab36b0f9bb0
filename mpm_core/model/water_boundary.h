#pragma once
/// @file
/// Where water of its own velocity cannot leave the soil.

#include "model/model.h"

namespace mpm::model
{
/// Adds a direction along which a node is impervious, of which the part along those that are there already is left out.
template <int D>
void add_direction(Vector<D> n, ImperviousNode<D>& node);

/// Makes facets with these tags impervious, in the place of those that were: there (w - v) . n = 0 for the normal n of
/// the facets. Where facets of a tag meet at a node under an angle, w = v, and at sides whose motion is prescribed.
/// @param supplied_tags  facets where water may enter
/// @note Collective
template <class G>
void set_impervious(Model<G>& model, std::span<const Index> facet_tags, std::span<const Index> supplied_tags);
} // namespace mpm::model
