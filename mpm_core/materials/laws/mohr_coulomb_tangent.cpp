#include "materials/laws/mohr_coulomb_tangent.h"

namespace mpm::materials::mohr_coulomb
{
namespace
{
/// The return to a region without the question whether the trial stress lies in it; nothing for the single points
Principal on_region(const Surface& m, Region region, Principal trial)
{
  switch (region)
  {
  case Region::elastic:
    return trial;
  case Region::plane:
    return on_plane(m, trial);
  case Region::compression_edge:
    return on_compression_edge(m, trial);
  case Region::extension_edge:
    return on_extension_edge(m, trial);
  case Region::tension_plane:
    return on_tension_plane(m, trial);
  case Region::tension_edge:
    return on_tension_edge(m, trial);
  case Region::shear_tension:
    return on_shear_tension_line(m, trial);
  default:
    return {0, 0, 0};
  }
}

/// A pair of principal directions i, j and the components of n_i n_j^T + n_j n_i^T
template <int D>
struct ShearDyad
{
  std::size_t i, j;
  SymTensor<D> components;
};

/// Dyads of the principal directions, sorted as the principal stresses. Out-of-plane shear is left out in plane strain.
template <int D>
struct Dyads
{
  std::array<SymTensor<D>, 3> normal; ///< n_i n_i^T
  std::array<ShearDyad<D>, D == 2 ? 1 : 3> shear;
};

Dyads<2> dyads(const Frame<2>& frame)
{
  const SymTensor<2> major{0.5 * (1 + frame.cos2), 0.5 * (1 - frame.cos2), 0, 0.5 * frame.sin2};
  const SymTensor<2> minor{0.5 * (1 - frame.cos2), 0.5 * (1 + frame.cos2), 0, -0.5 * frame.sin2};
  const SymTensor<2> zz{0, 0, 1, 0};
  const SymTensor<2> shear{-frame.sin2, frame.sin2, 0, frame.cos2};
  if (frame.zz_rank == 0)
    return {{zz, major, minor}, {{{1, 2, shear}}}};
  if (frame.zz_rank == 1)
    return {{major, zz, minor}, {{{0, 2, shear}}}};
  return {{major, minor, zz}, {{{0, 1, shear}}}};
}

SymTensor<3> dyad(const Direction& a) { return {a.x * a.x, a.y * a.y, a.z * a.z, a.x * a.y, a.y * a.z, a.x * a.z}; }

SymTensor<3> dyad(const Direction& a, const Direction& b)
{
  return {2 * a.x * b.x,         2 * a.y * b.y,         2 * a.z * b.z,
          a.x * b.y + a.y * b.x, a.y * b.z + a.z * b.y, a.x * b.z + a.z * b.x};
}

Dyads<3> dyads(const Frame<3>& frame)
{
  const auto& [a, b, c] = frame;
  return {{dyad(a), dyad(b), dyad(c)}, {{{0, 1, dyad(a, b)}, {1, 2, dyad(b, c)}, {0, 2, dyad(a, c)}}}};
}

/// What is left of the elastic shear stiffness between two principal directions: they turn with the trial stress, so
/// it is the ratio of the principal stress differences after and before the return (de Souza Neto et al. 2008, eq.
/// (A.34), box A.6). Where the directions are not determined, the limit of the ratio.
double shear_ratio(const Matrix3& map, const std::array<double, 3>& trial, const std::array<double, 3>& stress,
                   std::size_t i, std::size_t j)
{
  const double difference = trial[i] - trial[j];
  const bool distinct = difference > 1e-8 * (std::abs(trial[0]) + std::abs(trial[2]));
  return distinct ? (stress[i] - stress[j]) / difference : map[i][i] - map[i][j];
}

/// Adds factor * a b^T to a row-major matrix.
template <int D>
void add_product(double factor, const SymTensor<D>& a, const SymTensor<D>& b, double* matrix)
{
  for (std::size_t i = 0; i < n_stress<D>; ++i)
    for (std::size_t j = 0; j < n_stress<D>; ++j)
      matrix[i * n_stress<D> + j] += factor * a[i] * b[j];
}
} // namespace

Matrix3 region_map(const Surface& m, Region region)
{
  Surface homogeneous = m; // without the constants each return is its own derivative
  homogeneous.cohesion_cos = homogeneous.strength = homogeneous.tension = 0;
  constexpr std::array<Principal, 3> units{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Matrix3 map{};
  for (std::size_t j = 0; j < 3; ++j)
  {
    const Principal column = on_region(homogeneous, region, units[j]);
    map[0][j] = column.s1;
    map[1][j] = column.s2;
    map[2][j] = column.s3;
  }
  return map;
}

RegionMaps region_maps(const Surface& m)
{
  RegionMaps maps{};
  for (std::size_t region = 0; region < n_regions; ++region)
    maps.of[region] = region_map(m, static_cast<Region>(region));
  return maps;
}

template <int D>
void write_tangent(const Surface& m, const Matrix3& map, const Spectral<D>& trial, const Returned& returned,
                   double* tangent)
{
  const std::array<double, 3> before{trial.stress.s1, trial.stress.s2, trial.stress.s3};
  const std::array<double, 3> after{returned.stress.s1, returned.stress.s2, returned.stress.s3};
  const Dyads<D> basis = dyads(trial.frame);
  std::fill_n(tangent, n_stress<D> * n_stress<D>, 0.0);
  for (std::size_t i = 0; i < 3; ++i)
  {
    const double volumetric = m.moduli.lambda * (map[i][0] + map[i][1] + map[i][2]);
    SymTensor<D> row{};
    for (std::size_t j = 0; j < 3; ++j)
      for (std::size_t k = 0; k < n_stress<D>; ++k)
        row[k] += (volumetric + 2 * m.moduli.shear * map[i][j]) * basis.normal[j][k];
    add_product<D>(1, basis.normal[i], row, tangent);
  }
  for (const ShearDyad<D>& pair : basis.shear)
    add_product<D>(m.moduli.shear * shear_ratio(map, before, after, pair.i, pair.j), pair.components, pair.components,
                   tangent);
}

template void write_tangent<2>(const Surface&, const Matrix3&, const Spectral<2>&, const Returned&, double*);
template void write_tangent<3>(const Surface&, const Matrix3&, const Spectral<3>&, const Returned&, double*);
} // namespace mpm::materials::mohr_coulomb
