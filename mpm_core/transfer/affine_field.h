#pragma once
/// @file
/// Vector fields that are affine in a cell, worked out with the components of a vector side by side in a register.

#include "base/lanes.h"
#include "transfer/moments.h"

namespace mpm::transfer
{
/// The components of a vector in a vector register; in three dimensions the last lane is free.
template <int D>
using Components = std::conditional_t<D == 2, Pair, Lanes>;

template <int D>
[[gnu::always_inline]] inline Components<D> components(const Vector<D>& v)
{
  if constexpr (D == 2)
    return Pair{v[0], v[1]};
  else
    return Lanes{v[0], v[1], v[2], 0};
}

/// Each component of `lanes` vectors side by side.
/// @param vector  number l of them, a callable int -> Vector<D>
template <int D, class VectorAt>
[[gnu::always_inline]] inline std::array<Lanes, D> by_component(VectorAt&& vector)
{
  static_assert(lanes == 4);
  if constexpr (D == 2)
  {
    // Whole vectors are loaded, and then exchanged in registers: half the loads.
    const auto both = [&](int l) -> Lanes
    { return __builtin_shufflevector(components<2>(vector(l)), components<2>(vector(l + 1)), 0, 1, 2, 3); };
    const Lanes first = both(0), second = both(2);
    return {__builtin_shufflevector(first, second, 0, 2, 4, 6), __builtin_shufflevector(first, second, 1, 3, 5, 7)};
  }
  else
  {
    std::array<Lanes, D> columns;
    for (int a = 0; a < D; ++a)
      columns[a] = Lanes{vector(0)[a], vector(1)[a], vector(2)[a], vector(3)[a]};
    return columns;
  }
}

/// The field that values at the vertices have inside a cell.
/// @param at_vertex  value of vertex k, a callable int -> Vector<D>
template <int D, class AtVertex>
inline AffineField<D> affine_field_of_vertices(const CellShape<D>& shape, AtVertex&& at_vertex)
{
  const auto& gradient = shape.gradient;
  // Begun with the first vertex: g++ would set an array of vectors to zero in memory.
  Components<D> value = components<D>(at_vertex(0));
  std::array<Components<D>, D> by; // derivative by each coordinate
  for (int b = 0; b < D; ++b)
    by[b] = value * gradient[0][b];
  for (int k = 1; k <= D; ++k)
  {
    const Components<D> u = components<D>(at_vertex(k));
    value += u;
    for (int b = 0; b < D; ++b)
      by[b] += u * gradient[k][b];
  }
  AffineField<D> field;
  for (int a = 0; a < D; ++a)
  {
    field.value[a] = value[a] * (1.0 / (D + 1));
    for (int b = 0; b < D; ++b)
      field.gradient[a][b] = by[b][a];
  }
  return field;
}

/// The field that nodal values have inside a cell.
/// @param nodal  value of node i, a callable Index -> const Vector<D>&
template <int D, class Nodal>
inline AffineField<D> affine_field(const Mesh<D>& mesh, Index cell, Nodal&& nodal)
{
  const auto& nodes = mesh.cells[cell];
  return affine_field_of_vertices<D>(mesh.shapes[cell], [&](int k) -> const Vector<D>& { return nodal(nodes[k]); });
}
} // namespace mpm::transfer
