#include "materials/laws/linear_elastic.h"

#include "materials/tools/elasticity.h"

namespace mpm::materials
{
double p_wave_modulus(const LinearElastic& law) { return p_wave_modulus(elastic_moduli(law.young, law.poisson)); }

template <int D>
BatchReport update(const LinearElastic& law, const PointBatch<D>& points)
{
  const ElasticModuli moduli = elastic_moduli(law.young, law.poisson);
  const PointBatch<D> columns = points; // a copy that no store can alias, so that the loop vectorises
  BatchReport report;
  Index failed = 0;
#pragma GCC ivdep
  for (Index i = 0; i < columns.size; ++i)
  {
    const SymTensor<D> trial = elastic_trial<D>(moduli, columns, i);
    const bool usable = is_usable<D>(trial);
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      columns.stress[k][i] = usable ? trial[k] : columns.stress[k][i];
    failed += usable ? 0 : 1;
  }
  if (failed > 0)
    report.failed = unusable_points<D>(moduli, points);
  if (points.tangent)
    fill_elastic_tangent<D>(moduli, points.size, points.tangent);
  return report;
}

template BatchReport update<2>(const LinearElastic&, const PointBatch<2>&);
template BatchReport update<3>(const LinearElastic&, const PointBatch<3>&);
} // namespace mpm::materials
