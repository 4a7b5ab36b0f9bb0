#pragma once
/// @file
/// Two velocity fields at a node: what an impulse between them does to their velocities.

#include "model/model.h"

#include <algorithm>

namespace mpm::model
{
template <class M>
inline auto& field_at(M& model, Index number)
{
  return model.fields[static_cast<std::size_t>(number)];
}

/// The boundary condition of a node, or null.
template <class G, int D = G::dim>
inline const Support<D>* support_of(const VelocityField<G>& field, Index node)
{
  const auto found = std::ranges::lower_bound(field.supports, node, {}, &Support<D>::node);
  return found != field.supports.end() && found->node == node ? &*found : nullptr;
}

/// What a unit impulse along `direction` changes the velocity of a node by: P direction / m.
template <class G>
inline Vector<G::dim> mobility(const VelocityField<G>& field, Index node, Vector<G::dim> direction)
{
  constexpr int D = G::dim;
  if (const Support<D>* support = support_of(field, node))
    take_out_supported<D>(*support, direction);
  for (double& component : direction)
    component /= field.nodes[node].mass;
  return direction;
}

/// a + factor b
template <int D>
inline Vector<D> sum(const Vector<D>& a, double factor, const Vector<D>& b)
{
  Vector<D> result;
  for (int i = 0; i < D; ++i)
    result[i] = a[i] + factor * b[i];
  return result;
}

/// Two bodies at a node.
template <class G, int D = G::dim>
struct Pair
{
  const VelocityField<G>& first;
  const VelocityField<G>& second;
  Index node;

  /// What an impulse on the second body, and its opposite on the first, takes from the velocity of the first relative
  /// to that of the second.
  Vector<D> change(const Vector<D>& impulse) const
  {
    return sum<D>(model::mobility(first, node, impulse), 1, model::mobility(second, node, impulse));
  }

  /// By how much a unit impulse between the bodies along `direction` changes their relative velocity along `along`.
  double mobility(const Vector<D>& direction, const Vector<D>& along) const
  {
    return dot<D>(along, model::mobility(first, node, direction)) +
           dot<D>(along, model::mobility(second, node, direction));
  }
};
} // namespace mpm::model
