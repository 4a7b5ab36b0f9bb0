#include "transfer/moments.h"

namespace mpm
{
template <int D>
void gather(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape, CellMoments<D>& moments)
{
  constexpr int S = n_symmetric<D>;
  const double *x[D], *v[D], *s[S];
  for (int i = 0; i < D; ++i)
  {
    x[i] = particles.position[i].data();
    v[i] = particles.velocity[i].data();
  }
  for (int k = 0; k < S; ++k)
    s[k] = particles.stress[stress_component<D>[k]].data();
  const double* const mass = particles.mass.data();
  const double* const volume = particles.volume.data();

  CellMoments<D> sum{};
  for (Index p = first; p < last; ++p)
  {
    const double m = mass[p], vol = volume[p];
    double xi[D], m_xi[D];
    sum.volume += vol;
    sum.mass += m;
    for (int i = 0; i < D; ++i)
    {
      xi[i] = x[i][p] - shape.centre[i];
      m_xi[i] = m * xi[i];
      sum.mass_xi[i] += m_xi[i];
    }
    for (int k = 0; k < S; ++k)
    {
      sum.mass_xixi[k] += m_xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
      sum.stress[k] += vol * s[k][p];
    }
    for (int a = 0; a < D; ++a)
    {
      sum.momentum[a] += m * v[a][p];
      for (int b = 0; b < D; ++b)
        sum.momentum_xi[a][b] += m_xi[b] * v[a][p];
    }
  }
  moments.volume += sum.volume;
  moments.mass += sum.mass;
  for (int a = 0; a < D; ++a)
  {
    moments.mass_xi[a] += sum.mass_xi[a];
    moments.momentum[a] += sum.momentum[a];
    for (int b = 0; b < D; ++b)
      moments.momentum_xi[a][b] += sum.momentum_xi[a][b];
  }
  for (int k = 0; k < S; ++k)
  {
    moments.mass_xixi[k] += sum.mass_xixi[k];
    moments.stress[k] += sum.stress[k];
  }
}

template <int D>
void gather(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
            TractionMoments<D>& moments)
{
  for (Index p = first; p < last; ++p)
    for (int a = 0; a < D; ++a)
    {
      const double t = particles.traction[a][p];
      moments.force[a] += t;
      for (int b = 0; b < D; ++b)
        moments.force_xi[a][b] += t * (particles.position[b][p] - shape.centre[b]);
    }
}

#define INSTANTIATE(D)                                                                                                 \
  template void gather(const Particles<D>&, Index, Index, const CellShape<D>&, CellMoments<D>&);                       \
  template void gather(const Particles<D>&, Index, Index, const CellShape<D>&, TractionMoments<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm
