#include "implicit/nodal_stiffness.h"

namespace mpm::implicit
{
template <int D>
std::vector<double> nodal_stiffness(const Mesh<D>& mesh, const MaterialPoints<D>& points, double WaveModuli::*modulus)
{
  std::vector<double> stiffness(mesh.points.size(), 0.0);
  for (const Run& run : points.runs)
  {
    double volume = 0;
    for (Index p = run.first; p < run.last; ++p)
      volume += points.particles.volume[p];
    const double mean = mean_moduli(points, run).*modulus;
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D>& g = mesh.shapes[run.cell].gradient[k];
      stiffness[mesh.cells[run.cell][k]] += volume * mean * dot<D>(g, g);
    }
  }
  return stiffness;
}

template std::vector<double> nodal_stiffness(const Mesh<2>&, const MaterialPoints<2>&, double WaveModuli::*);
template std::vector<double> nodal_stiffness(const Mesh<3>&, const MaterialPoints<3>&, double WaveModuli::*);
} // namespace mpm::implicit
