#include "mesh/search.h"

#include <algorithm>
#include <cmath>

namespace mpm::mesh
{
namespace
{
/// Smallest shape function at x and its vertex.
template <int D>
std::pair<double, int> smallest(const CellShape<D>& shape, const Vector<D>& x)
{
  const auto n = shape_functions<D>(shape, x);
  const auto it = std::min_element(n.begin(), n.end());
  return {*it, static_cast<int>(it - n.begin())};
}
} // namespace

template <int D>
Index find_cell_in_bins(const Mesh<D>& mesh, const Vector<D>& x)
{
  const auto& bins = mesh.bins;
  std::size_t bin = 0;
  for (int i = D - 1; i >= 0; --i)
  {
    const double at = (x[i] - bins.origin[i]) / bins.size;
    if (!(at >= -1e-6 && at <= bins.counts[i] + 1e-6))
      return none;
    const Index k = std::clamp(static_cast<Index>(at), Index(0), bins.counts[i] - 1);
    bin = bin * static_cast<std::size_t>(bins.counts[i]) + static_cast<std::size_t>(k);
  }
  Index best = none;
  double best_value = -inside_tolerance_of(mesh);
  for (Index j = bins.offsets[bin]; j < bins.offsets[bin + 1]; ++j)
  {
    const Index c = bins.cells[static_cast<std::size_t>(j)];
    const double value = smallest<D>(mesh.shapes[c], x).first;
    if (value >= best_value && (best == none || value > best_value))
    {
      best = c;
      best_value = value;
    }
  }
  return best;
}

template <int D>
Location walk_to_cell(const Mesh<D>& mesh, const Vector<D>& x, Index start)
{
  Location location;
  Index c = start;
  // A straight walk crosses a few cells for each bin on its way; far more than that is a circle, which only bins can
  // end.
  const double tolerance = inside_tolerance_of(mesh);
  Index longest_walk = 64;
  for (Index count : mesh.bins.counts)
    longest_walk += 4 * count;
  for (Index step = 0; c != none && step < longest_walk; ++step)
  {
    const auto [value, vertex] = smallest<D>(mesh.shapes[c], x);
    if (value >= -tolerance)
    {
      location.cell = c;
      return location;
    }
    if (std::isnan(value))
      return location;
    location.exit_cell = c;
    location.exit_facet = vertex;
    c = mesh.neighbours[c][vertex];
  }
  return location;
}

template <int D>
Location find_cell(const Mesh<D>& mesh, const Vector<D>& x, Index start)
{
  Location location = walk_to_cell<D>(mesh, x, start);
  if (location.cell == none && location.exit_cell != none)
    location.cell = find_cell_in_bins<D>(mesh, x);
  return location;
}

template Index find_cell_in_bins<2>(const Mesh<2>&, const Vector<2>&);
template Index find_cell_in_bins<3>(const Mesh<3>&, const Vector<3>&);
template Location walk_to_cell<2>(const Mesh<2>&, const Vector<2>&, Index);
template Location walk_to_cell<3>(const Mesh<3>&, const Vector<3>&, Index);
template Location find_cell<2>(const Mesh<2>&, const Vector<2>&, Index);
template Location find_cell<3>(const Mesh<3>&, const Vector<3>&, Index);
} // namespace mpm::mesh
