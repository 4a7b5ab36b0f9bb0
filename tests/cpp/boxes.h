#pragma once
/// Meshes that tests share: a box cut in simplices, with its inner nodes moved about.

#include "mesh/part.h"

#include <algorithm>
#include <numeric>
#include <random>

namespace mpm::test
{
using namespace mesh;

template <int D>
struct BoxArrays
{
  std::vector<double> points;
  std::vector<Index> cells;
  std::vector<Index> facets;
  std::vector<Index> facet_tags; ///< 2 axis + 1 on the low side, 2 axis + 2 on the high side

  MeshInput<D> input() const { return {points, cells, {}, facets, facet_tags, {}, {}, {}}; }
  Mesh<D> mesh() const { return make_mesh<D>(input(), 0); }
};

/// A unit box of n^D cubes, each cut in D! simplices (Kuhn). Inner nodes move by up to `shake` of a cube's side.
template <int D>
BoxArrays<D> box(int n, double shake = 0, unsigned seed = 1)
{
  BoxArrays<D> arrays;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> move(-shake / n, shake / n);
  const int side = n + 1, count = D == 2 ? side * side : side * side * side;
  auto place = [&](int node)
  {
    std::array<int, D> at;
    for (int i = 0; i < D; ++i, node /= side)
      at[i] = node % side;
    return at;
  };
  for (int node = 0; node < count; ++node)
  {
    const auto at = place(node);
    const bool inner = std::all_of(at.begin(), at.end(), [n](int k) { return k > 0 && k < n; });
    for (int i = 0; i < D; ++i)
      arrays.points.push_back(static_cast<double>(at[i]) / n + (inner ? move(random) : 0.0));
  }
  std::array<int, D> stride;
  for (int i = 0, s = 1; i < D; ++i, s *= side)
    stride[i] = s;
  for (int node = 0; node < count; ++node)
  {
    const auto at = place(node);
    if (std::any_of(at.begin(), at.end(), [n](int k) { return k == n; }))
      continue;
    std::array<int, D> order;
    for (int i = 0; i < D; ++i)
      order[i] = i;
    do
    {
      Index corner = node;
      arrays.cells.push_back(corner);
      for (int axis : order)
        arrays.cells.push_back(corner += stride[axis]);
    } while (std::next_permutation(order.begin(), order.end()));
  }
  for (std::size_t c = 0; c < arrays.cells.size() / (D + 1); ++c)
    for (int k = 0; k <= D; ++k)
    {
      std::array<Index, D + 1> cell;
      std::copy_n(&arrays.cells[c * (D + 1)], D + 1, cell.begin());
      const auto nodes = facet_nodes<D>(cell, k);
      for (int axis = 0; axis < D; ++axis)
        for (int end : {0, n})
          if (std::all_of(nodes.begin(), nodes.end(), [&](Index node) { return place(node)[axis] == end; }))
          {
            arrays.facets.insert(arrays.facets.end(), nodes.begin(), nodes.end());
            arrays.facet_tags.push_back(2 * axis + (end == 0 ? 1 : 2));
          }
    }
  return arrays;
}

/// All of a mesh.
template <int D>
MeshPart whole(const Mesh<D>& mesh)
{
  std::vector<Index> cells(mesh.cells.size());
  std::iota(cells.begin(), cells.end(), 0);
  return make_part<D>(mesh, cells, {});
}
} // namespace mpm::test
