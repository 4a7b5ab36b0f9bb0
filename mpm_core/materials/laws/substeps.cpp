#include "materials/laws/substeps.h"

#include "base/tensor.h"

#include <algorithm>
#include <cmath>

namespace mpm::materials
{
namespace
{
/// Stress and states of a point
template <int D>
struct Values
{
  SymTensor<D> stress;
  std::array<double, max_states> state;
};

template <int D>
Values<D> values_of(const PointBatch<D>& point, int states)
{
  Values<D> values;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    values.stress[k] = *point.stress[k];
  for (int k = 0; k < states; ++k)
    values.state[static_cast<std::size_t>(k)] = *point.state[k];
  return values;
}

template <int D>
void put_back(const Values<D>& values, int states, const PointBatch<D>& point)
{
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    *point.stress[k] = values.stress[k];
  for (int k = 0; k < states; ++k)
    *point.state[k] = values.state[static_cast<std::size_t>(k)];
}

/// Updates one point by so many equal parts of its strain increment. What it reports is that of the whole: a part that
/// yields makes the point plastic, and one that fails makes it fail.
template <int D>
BatchReport updated_by(int parts, const Law& law, PointBatch<D> point)
{
  SymTensor<D> part;
  Matrix<D> gradient; // of a part; that parts follow one another adds a term of second order, which is left out
  const double start = point.time;
  point.dt /= parts;
  for (std::size_t k = 0; k < D * D && point.deformation[k]; ++k)
  {
    const double identity = k % (D + 1) == 0 ? 1 : 0;
    gradient[k / D][k % D] = identity + (*point.deformation[k] - identity) / parts;
    point.deformation[k] = &gradient[k / D][k % D];
  }
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    part[k] = *point.strain_increment[k] / parts;
    point.strain_increment[k] = &part[k];
  }
  BatchReport whole;
  for (int i = 0; i < parts && whole.failed.empty(); ++i)
  {
    if (std::isfinite(point.dt))
      point.time = start + i * point.dt;
    const BatchReport report = update<D>(law, point);
    whole.plastic = std::max(whole.plastic, report.plastic);
    whole.failed = report.failed;
  }
  return whole;
}
} // namespace

template <int D>
BatchReport update_in_parts(const Law& law, const PointBatch<D>& points, const std::vector<Index>& failed)
{
  const int states = n_state(law);
  BatchReport total;
  for (Index i : failed)
  {
    const BatchSlice<D> point(points, i, 1, states);
    const Values<D> start = values_of(point.batch, states);
    BatchReport report{0, {0}};
    for (int parts = 2; parts <= most_parts && !report.failed.empty(); parts *= 2)
    {
      put_back(start, states, point.batch);
      report = updated_by(parts, law, point.batch);
    }
    if (report.failed.empty())
      total.plastic += report.plastic;
    else
    {
      put_back(start, states, point.batch);
      total.failed.push_back(i);
    }
  }
  return total;
}

template BatchReport update_in_parts<2>(const Law&, const PointBatch<2>&, const std::vector<Index>&);
template BatchReport update_in_parts<3>(const Law&, const PointBatch<3>&, const std::vector<Index>&);
} // namespace mpm::materials
