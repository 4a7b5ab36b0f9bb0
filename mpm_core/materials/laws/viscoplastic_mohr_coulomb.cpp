#include "materials/laws/viscoplastic_mohr_coulomb.h"

#include "base/work_columns.h"
#include "materials/tools/elasticity.h"

#include <algorithm>
#include <numbers>

namespace mpm::materials
{
namespace
{
/// Stress and plastic strain of a block of points before the increment
template <int D>
struct Start
{
  std::array<std::array<double, block_size>, n_stress<D>> stress;
  std::array<double, block_size> plastic_strain;
};

template <int D>
void copy_start(const PointBatch<D>& points, Start<D>& start)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    std::copy_n(points.stress[k], points.size, start.stress[k].begin());
  std::copy_n(points.state[0], points.size, start.plastic_strain.begin());
}

/// Takes the points from where the law without viscosity has them back towards their trial stress.
/// @param left  fraction of the overstress that remains at the end, 1 / (1 + a)
template <int D>
void restore_overstress(const ElasticModuli& moduli, double left, const Start<D>& start, const PointBatch<D>& points)
{
  PointBatch<D> before = points;
  std::array<std::array<double, block_size>, n_stress<D>> stress = start.stress;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    before.stress[k] = stress[k].data();
  for (Index i = 0; i < points.size; ++i)
  {
    const SymTensor<D> trial = elastic_trial<D>(moduli, before, i);
    if (!is_usable<D>(trial)) // it has failed, and is as it was
      continue;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] += left * (trial[k] - points.stress[k][i]);
    double& plastic = points.state[0][i];
    plastic -= left * (plastic - start.plastic_strain[static_cast<std::size_t>(i)]);
  }
}

template <int D>
void mix_tangents(const ElasticModuli& moduli, double left, const PointBatch<D>& points)
{
  const auto elastic = elastic_tangent<D>(moduli);
  for (Index i = 0; i < points.size; ++i)
    for (std::size_t k = 0; k < elastic.size(); ++k)
    {
      double& entry = points.tangent[static_cast<std::size_t>(i) * elastic.size() + k];
      entry += left * (elastic[k] - entry);
    }
}
} // namespace

double relaxation_time(const ViscoplasticMohrCoulomb& law)
{
  constexpr double degree = std::numbers::pi / 180;
  const MohrCoulomb& soil = law.inviscid;
  const ElasticModuli moduli = elastic_moduli(soil.young, soil.poisson);
  const double sines = std::sin(soil.friction_angle * degree) * std::sin(soil.dilation_angle * degree);
  return law.viscosity / (moduli.shear + (moduli.lambda + moduli.shear) * sines);
}

template <int D>
BatchReport update(const ViscoplasticMohrCoulomb& law, const PointBatch<D>& points)
{
  const ElasticModuli moduli = elastic_moduli(law.inviscid.young, law.inviscid.poisson);
  const double left = 1 / (1 + points.dt / relaxation_time(law));
  BatchReport total;
  Start<D> start;
  for (Index first = 0; first < points.size; first += static_cast<Index>(block_size))
  {
    const Index size = std::min(static_cast<Index>(block_size), points.size - first);
    const BatchSlice<D> block(points, first, size, 1);
    copy_start(block.batch, start);
    const BatchReport report = update<D>(law.inviscid, block.batch);
    total.plastic += report.plastic;
    for (Index i : report.failed)
      total.failed.push_back(first + i);
    if (report.plastic > 0)
      restore_overstress(moduli, left, start, block.batch);
    if (points.tangent)
      mix_tangents(moduli, left, block.batch);
  }
  return total;
}

template BatchReport update<2>(const ViscoplasticMohrCoulomb&, const PointBatch<2>&);
template BatchReport update<3>(const ViscoplasticMohrCoulomb&, const PointBatch<3>&);
} // namespace mpm::materials
