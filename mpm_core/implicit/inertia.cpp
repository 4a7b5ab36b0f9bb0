#include "implicit/inertia.h"

#include <cmath>

namespace mpm
{
template <class G, int D>
std::vector<double> shear_frequencies(Model<G>& model)
{
  std::vector<double> stiffness(model.mesh.points.size(), 0.0);
  for (const Run& run : model.order.runs)
  {
    double volume = 0;
    for (Index p = run.first; p < run.last; ++p)
      volume += model.particles.volume[p];
    const double shear = shear_modulus(model.laws[run.material]);
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D>& g = model.mesh.shapes[run.cell].gradient[k];
      stiffness[model.mesh.cells[run.cell][k]] += volume * shear * dot<D>(g, g);
    }
  }
  sum_shared(model.exchange, stiffness.data(), 1);
  std::vector<double> frequency(stiffness.size(), 0.0);
  for (std::size_t i = 0; i < frequency.size(); ++i)
    if (model.fields.front().nodes[i].mass > 0)
      frequency[i] = std::sqrt(stiffness[i] / model.fields.front().nodes[i].mass);
  return frequency;
}

template std::vector<double> shear_frequencies(Model<PlaneStrain>&);
template std::vector<double> shear_frequencies(Model<Axisymmetric>&);
template std::vector<double> shear_frequencies(Model<Solid>&);
} // namespace mpm
