#pragma once
/// @file
/// Elasticity with moduli in proportion to the pressure, by their secants over an increment: what its laws share.
/// Source: Borja (1991), CMAME 92, 343-353.

#include "base/lanes.h"
#include "materials/tools/deviator.h"
#include "materials/tools/dual.h"

#include <cmath>

namespace mpm::materials
{
/// The growth of the pressure over an increment, by its logarithm y
template <class T>
struct Growth
{
  T factor; ///< exp(y): the pressure over that of the start
  T mean;   ///< (exp(y) - 1) / y: the secant modulus over that of the start
  T slope;  ///< derivative of the mean by y
};

/// Most increments are small, and take the series of the mean.
inline constexpr double small_growth = 0.05;

[[gnu::noinline]] inline Growth<double> large_growth(double y)
{
  const double factor = std::exp(y), mean = std::expm1(y) / y;
  return {factor, mean, (factor - mean) / y};
}

template <class T>
Growth<T> growth_of(const T& y)
{
  constexpr std::array c{1.0, 1.0 / 2, 1.0 / 6, 1.0 / 24, 1.0 / 120, 1.0 / 720, 1.0 / 5040, 1.0 / 40320, 1.0 / 362880};
  T mean = T{} + c.back(), slope{};
  for (std::size_t k = c.size() - 1; k-- > 0;)
  {
    slope = slope * y + mean;
    mean = mean * y + c[k];
  }
  Growth<T> growth{1 + y * mean, mean, slope};
  const auto is_large = absolute(y) > small_growth;
  if (!any(is_large))
    return growth;
  if constexpr (std::is_same_v<T, double>)
    return large_growth(y);
  else
    for (int l = 0; l < lanes; ++l)
      if (is_large[l])
      {
        const Growth<double> large = large_growth(y[l]);
        growth.factor[l] = large.factor;
        growth.mean[l] = large.mean;
        growth.slope[l] = large.slope;
      }
  return growth;
}

/// exp(y) and (exp(y) - 1) / y, for a small y without a call of the library
template <class T>
struct Exponential
{
  T factor, mean;
};

template <class T>
Exponential<T> exponential_of(const T& y)
{
  const Growth<Number<T>> growth = growth_of(value_of(y));
  return {chained(y, growth.factor, growth.factor), chained(y, growth.mean, growth.slope)};
}

/// A trial deviator s + 2 G e and its q = sqrt(3 J2), where the secant modulus G depends on the end of the increment
template <int D>
struct SecantTrial
{
  double shear;          ///< G
  SymTensor<D> deviator; ///< s + 2 G e
  double q;              ///< sqrt(3 J2) of it
};

/// @param stress  deviator at the start of the increment
/// @param strain  deviator of the strain increment, tensor components
template <int D>
SecantTrial<D> secant_trial(double shear, const SymTensor<D>& stress, const SymTensor<D>& strain)
{
  SecantTrial<D> trial{shear, stress, 0};
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    trial.deviator[k] += 2 * shear * strain[k];
  trial.q = std::sqrt(3.0) * radius<D>(trial.deviator);
  return trial;
}

/// Derivative of q of the trial by G
template <int D>
double q_by_shear(const SecantTrial<D>& trial, const SymTensor<D>& strain)
{
  return trial.q > 0 ? 3 * product<D>(trial.deviator, strain) / trial.q : 0.0;
}

/// Derivatives of a new stress -p 1 + r s, with the trial deviator s and pressures positive in compression
struct SecantSlopes
{
  double pressure; ///< of p
  double shear;    ///< of G
  double ratio;    ///< of r
};

/// Derivative of the stress by what the slopes are derivatives by
template <int D>
SymTensor<D> stress_slope(const SecantTrial<D>& trial, const SymTensor<D>& strain, double ratio, const SecantSlopes& by)
{
  SymTensor<D> slope;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    slope[k] = 2 * ratio * strain[k] * by.shear + trial.deviator[k] * by.ratio - (k < 3 ? by.pressure : 0.0);
  return slope;
}

/// Writes the tangent of -p 1 + r s.
/// @param by_volume  derivatives by the volumetric strain, positive in compression
/// @param by_q       derivatives by q of the trial at a fixed shear modulus
template <int D>
void write_secant_tangent(const SecantTrial<D>& trial, const SymTensor<D>& strain, double ratio,
                          const SecantSlopes& by_volume, const SecantSlopes& by_q, double* tangent)
{
  constexpr std::size_t n = n_stress<D>;
  const double q_by_strain = trial.q > 0 ? 3 * trial.shear / trial.q : 0.0;
  const SymTensor<D> volumetric = stress_slope<D>(trial, strain, ratio, by_volume);
  const SymTensor<D> deviatoric = stress_slope<D>(trial, strain, ratio, by_q);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
    {
      const double projected = (i == j ? (i < 3 ? 1.0 : 0.5) : 0.0) - (i < 3 && j < 3 ? 1.0 / 3 : 0.0);
      tangent[i * n + j] = 2 * ratio * trial.shear * projected - (j < 3 ? volumetric[i] : 0.0) +
                           deviatoric[i] * q_by_strain * trial.deviator[j];
    }
}

/// Adds what the tangent of -p 1 + r s has from one more number that the trial deviator decides.
/// @param by           derivatives by the number, at a fixed volumetric strain and q of the trial
/// @param by_deviator  derivative of the number by the trial deviator, itself a deviator
template <int D>
void add_secant_tangent(const SecantTrial<D>& trial, const SymTensor<D>& strain, double ratio, const SecantSlopes& by,
                        const SymTensor<D>& by_deviator, double* tangent)
{
  constexpr std::size_t n = n_stress<D>;
  const SymTensor<D> stress = stress_slope<D>(trial, strain, ratio, by);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      tangent[i * n + j] += stress[i] * 2 * trial.shear * by_deviator[j];
}
} // namespace mpm::materials
