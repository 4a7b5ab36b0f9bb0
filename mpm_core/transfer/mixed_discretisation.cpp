#include "transfer/mixed_discretisation.h"

namespace mpm
{
template <int D>
void average_volumetric_strain(const Mesh<D>& mesh, std::span<const double> volume, NodeExchange& exchange,
                               VolumetricSums& sums, std::span<double> theta)
{
  sums.assign(mesh.points.size(), {0.0, 0.0});
  for (Index c = 0; c < mesh.owned_cells; ++c)
    if (volume[c] > 0)
      for (Index node : mesh.cells[c])
      {
        sums[node][0] += theta[c] * volume[c];
        sums[node][1] += volume[c];
      }
  sum_shared(exchange, sums);
  for (Index c = 0; c < mesh.owned_cells; ++c)
    if (volume[c] > 0)
    {
      theta[c] = 0;
      for (Index node : mesh.cells[c])
        theta[c] += sums[node][0] / sums[node][1] / (D + 1);
    }
}

template void average_volumetric_strain<2>(const Mesh<2>&, std::span<const double>, NodeExchange&, VolumetricSums&,
                                           std::span<double>);
template void average_volumetric_strain<3>(const Mesh<3>&, std::span<const double>, NodeExchange&, VolumetricSums&,
                                           std::span<double>);
} // namespace mpm
