#pragma once
/// @file
/// Elastic ground beyond a border of the mesh, condensed to the nodes there.

#include "base/tensor.h"

#include <vector>

namespace mpm::transfer
{
/// The forces of the far field on the nodes of its border are f = held + W g - K u, with their displacement u since it
/// began to act and gravity g.
template <int D>
struct FarField
{
  std::size_t size = 0;             ///< nodes of the border over all ranks; none where there is no far field
  std::vector<Index> nodes;         ///< those whose forces this rank sums
  std::vector<std::size_t> numbers; ///< of these among all of the border
  std::vector<double> stiffness;    ///< K [N/m]: rows of the components of `nodes`, columns of all; row-major
  std::vector<Matrix<D>> mass;      ///< W of `nodes` [kg]
  std::vector<Vector<D>> held;      ///< of `nodes`: what was there when the far field began to act [N]
  std::vector<double> displacement; ///< of all nodes of the border [m], (size, D)
};

/// K times a displacement of all nodes of the border [m], (size, D): forces on this rank's nodes of it.
template <int D>
std::vector<Vector<D>> border_forces(const FarField<D>& far, const std::vector<double>& displacement)
{
  std::vector<Vector<D>> forces(far.nodes.size());
  const std::size_t width = far.size * D;
  for (std::size_t k = 0; k < forces.size(); ++k)
    for (std::size_t a = 0; a < D; ++a)
    {
      const double* const row = &far.stiffness[(k * D + a) * width];
      double sum = 0;
      for (std::size_t j = 0; j < width; ++j)
        sum += row[j] * displacement[j];
      forces[k][a] = sum;
    }
  return forces;
}
} // namespace mpm::transfer
