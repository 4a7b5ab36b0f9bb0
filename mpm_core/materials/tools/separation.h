#pragma once
/// @file
/// Soil that has been pulled apart closes again before it carries pressure.
///
/// Once its tensile strength is reached, soil gives way to any further expansion. A law without memory of that
/// expansion would resist as soon as the soil is pressed together again, at a larger volume than it had, and soil that
/// loosens and settles, such as falling grains, would gain volume in each cycle. So the laws keep the volumetric strain
/// of the expansion, the separation, and soil that has one is compressed without pressure until the separation is zero.
/// The mean stress is between zero and the tensile strength meanwhile: energy is dissipated when soil is pulled apart,
/// and none is gained when it closes.
///
/// Sources: Dunatunga, Kamrin (2015), J. Fluid Mech. 779, 483-513 (no pressure below the critical density); Tampubolon
/// et al. (2017), ACM Trans. Graph. 36, 105, section 4.3.4 (the strain that is kept).

#include "base/work_columns.h"
#include "materials/tools/deviator.h"

namespace mpm::materials
{
/// Whether any of some points has a separation: most blocks of points have none, and need not look at it.
inline bool is_separated(const double* separation, Index first, Index last)
{
  std::int64_t count = 0;
#pragma GCC ivdep
  for (Index i = first; i < last; ++i)
    count += separation[i] > 0 ? 1 : 0;
  return count > 0;
}

/// Closes the separation of a point as far as its trial stress is a pressure, which falls by that.
/// @param bulk  modulus K [Pa]
/// @returns the volumetric strain that closed [-]
template <int D>
inline double close_separation(SymTensor<D>& trial, double separation, double bulk)
{
  const double p = mean<D>(trial);
  const double needed = p < 0 ? -p / bulk : 0.0;
  const double closed = needed < separation ? needed : separation;
  for (std::size_t k = 0; k < 3; ++k)
    trial[k] += bulk * closed;
  return closed;
}

/// Makes a tangent that of a point whose separation is not closed at the end of an increment that closes it: its stress
/// depends on the deviatoric strain only.
template <int D>
void remove_volumetric_part(double* tangent)
{
  constexpr std::size_t n = n_stress<D>;
  for (std::size_t k = 0; k < n; ++k)
  {
    double* const row = tangent + k * n;
    const double mean = (row[0] + row[1] + row[2]) / 3;
    for (std::size_t j = 0; j < 3; ++j)
      row[j] -= mean;
  }
}

/// Does that to the tangents of a block, from first to last, where an increment has closed a part of the separation.
/// @param closed  for each point of the block
template <int D>
void correct_tangents(const WorkColumn<double>& closed, const double* separation, double* tangents, Index first,
                      Index last)
{
  for (Index i = first; i < last; ++i)
    if (closed[static_cast<std::size_t>(i - first)] > 0 && separation[i] > 0)
      remove_volumetric_part<D>(tangents + static_cast<std::size_t>(i) * n_stress<D> * n_stress<D>);
}
} // namespace mpm::materials
