#pragma once
/// @file
/// The particles as steps read them, in runs by cells, with the laws that they follow.

#include "model/model.h"

namespace mpm::model
{
/// A view of a model's particles.
template <int D>
struct MaterialPoints
{
  const Particles<D>& particles;
  const std::vector<Run>& runs;
  const std::vector<Law>& laws;
};

template <class G, int D = G::dim>
MaterialPoints<D> material_points(const Model<G>& model)
{
  return {model.particles, model.order.runs, model.laws};
}

/// The rows of resting cells likewise.
template <class G, int D = G::dim>
MaterialPoints<D> resting_points(const Model<G>& model)
{
  return {model.particles, model.fields.front().resting.runs, model.laws};
}
} // namespace mpm::model
