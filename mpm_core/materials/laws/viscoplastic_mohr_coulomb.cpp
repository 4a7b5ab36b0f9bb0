#include "materials/laws/viscoplastic_mohr_coulomb.h"

#include "base/work_columns.h"
#include "materials/tools/elasticity.h"
#include "materials/tools/separation.h"

#include <algorithm>
#include <numbers>

namespace mpm::materials
{
namespace
{
constexpr std::size_t n_states = ViscoplasticMohrCoulomb::state_names.size();

/// Stress and states of a block of points before the increment
template <int D>
struct Start
{
  std::array<std::array<double, block_size>, n_stress<D>> stress;
  std::array<std::array<double, block_size>, n_states> state;
};

template <int D>
void copy_start(const PointBatch<D>& points, Start<D>& start)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    std::copy_n(points.stress[k], points.size, start.stress[k].begin());
  for (std::size_t k = 0; k < n_states; ++k)
    std::copy_n(points.state[k], points.size, start.state[k].begin());
}

/// Takes the points from where the law without viscosity has them back towards their trial stress, and their states
/// towards those of that stress. What an increment closes of a separation meets no viscosity.
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
    SymTensor<D> trial = elastic_trial<D>(moduli, before, i);
    if (!is_usable<D>(trial)) // it has failed, and is as it was
      continue;
    std::array<double, n_states> state;
    for (std::size_t k = 0; k < n_states; ++k)
      state[k] = start.state[k][static_cast<std::size_t>(i)];
    state[1] -= close_separation<D>(trial, state[1], bulk_modulus(moduli));
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      points.stress[k][i] += left * (trial[k] - points.stress[k][i]);
    for (std::size_t k = 0; k < n_states; ++k)
      points.state[k][i] += left * (state[k] - points.state[k][i]);
  }
}

template <int D>
void mix_tangents(const ElasticModuli& moduli, double left, const Start<D>& start, const PointBatch<D>& points)
{
  const auto elastic = elastic_tangent<D>(moduli);
  for (Index i = 0; i < points.size; ++i)
  {
    double* const tangent = points.tangent + static_cast<std::size_t>(i) * elastic.size();
    for (std::size_t k = 0; k < elastic.size(); ++k)
      tangent[k] += left * (elastic[k] - tangent[k]);
    const double separation = points.state[1][i];
    if (separation > 0 && separation < start.state[1][static_cast<std::size_t>(i)])
      remove_volumetric_part<D>(tangent);
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
    const BatchSlice<D> block(points, first, size, static_cast<int>(n_states));
    copy_start(block.batch, start);
    const BatchReport report = update<D>(law.inviscid, block.batch);
    total.plastic += report.plastic;
    for (Index i : report.failed)
      total.failed.push_back(first + i);
    if (report.plastic > 0)
      restore_overstress(moduli, left, start, block.batch);
    if (points.tangent)
      mix_tangents(moduli, left, start, block.batch);
  }
  return total;
}

template BatchReport update<2>(const ViscoplasticMohrCoulomb&, const PointBatch<2>&);
template BatchReport update<3>(const ViscoplasticMohrCoulomb&, const PointBatch<3>&);
} // namespace mpm::materials
