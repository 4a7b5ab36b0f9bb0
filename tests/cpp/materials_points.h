#pragma once
/// @file
/// Points for the tests of the laws: columns with their storage, and materials that between them use every feature.

#include "materials/laws/law.h"
#include "materials/tools/spectral.h"

#include <cmath>
#include <numbers>
#include <random>
#include <sstream>

namespace mpm::test
{
using namespace materials;

/// Points with storage. Stress, strain increment and states start at zero.
template <int D>
struct Points
{
  explicit Points(Index size) : size(size), tangent(static_cast<std::size_t>(size * n_stress<D> * n_stress<D>))
  {
    for (std::size_t k = 0; k < n_stress<D>; ++k)
    {
      strain_increment[k].assign(static_cast<std::size_t>(size), 0.0);
      stress[k].assign(static_cast<std::size_t>(size), 0.0);
    }
    plastic_strain.assign(static_cast<std::size_t>(size), 0.0);
    separation.assign(static_cast<std::size_t>(size), 0.0);
  }

  template <class L>
  BatchReport update(const L& law, bool with_tangent = false)
  {
    return materials::update<D>(law, batch(with_tangent));
  }

  PointBatch<D> batch(bool with_tangent)
  {
    PointBatch<D> points;
    points.size = size;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
    {
      points.strain_increment[k] = strain_increment[k].data();
      points.stress[k] = stress[k].data();
    }
    state = {plastic_strain.data(), separation.data()};
    points.state = state.data();
    points.tangent = with_tangent ? tangent.data() : nullptr;
    return points;
  }

  SymTensor<D> stress_of(Index i) const { return row(stress, i); }
  SymTensor<D> strain_increment_of(Index i) const { return row(strain_increment, i); }
  void set_stress(Index i, const SymTensor<D>& value) { set_row(stress, i, value); }
  void set_strain_increment(Index i, const SymTensor<D>& value) { set_row(strain_increment, i, value); }
  void clear_strain_increment()
  {
    for (Column& column : strain_increment)
      std::fill(column.begin(), column.end(), 0.0);
  }

  Index size;
  std::array<Column, n_stress<D>> strain_increment, stress;
  Column plastic_strain, separation, tangent;

private:
  static SymTensor<D> row(const std::array<Column, n_stress<D>>& columns, Index i)
  {
    SymTensor<D> value;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      value[k] = columns[k][static_cast<std::size_t>(i)];
    return value;
  }
  static void set_row(std::array<Column, n_stress<D>>& columns, Index i, const SymTensor<D>& value)
  {
    for (std::size_t k = 0; k < n_stress<D>; ++k)
      columns[k][static_cast<std::size_t>(i)] = value[k];
  }
  std::array<double*, 2> state{};
};

inline constexpr double degree = std::numbers::pi / 180;

/// Materials with and without cohesion, friction, dilation and tension cut-off
inline std::vector<MohrCoulomb> materials()
{
  return {{200e3, 0.33, 1e3, 25, 0},      {200e3, 0.33, 1e3, 25, 25},      {200e3, 0.2, 1e3, 35, 10},
          {200e3, 0.33, 0, 30, 0},        {200e3, 0.33, 0, 30, 30},        {200e3, 0.33, 1e3, 0, 0},
          {200e3, 0.0, 1e3, 20, 5},       {200e3, 0.499, 1e3, 30, 15},     {200e3, -0.3, 1e3, 30, 15},
          {200e3, 0.33, 1e3, 25, 0, 500}, {200e3, 0.33, 1e3, 25, 25, 500}, {200e3, 0.2, 1e3, 35, 10, 0},
          {200e3, 0.33, 1e3, 0, 0, 300},  {200e3, 0.33, 0, 30, 10, 0},     {200e3, 0.45, 1e3, 40, 40, 1000}};
}

/// Materials at the ends of their parameters' ranges
inline std::vector<MohrCoulomb> extreme_materials()
{
  return {{200e3, 0.499999975, 1e3, 30, 15},  {200e3, 0.499999975, 0, 89.9, 0, 300}, {200e3, -0.99, 1e3, 89.9, 89.9},
          {200e3, -0.99, 1e3, 30, 1e-9, 300}, {200e3, 0.3, 1e3, 1e-8, 1e-8},         {200e3, 0.3, 0, 0, 0, 0}};
}

/// Surface of a material, as the law builds it
inline mohr_coulomb::Surface surface_of(const MohrCoulomb& law)
{
  return mohr_coulomb::surface(elastic_moduli(law.young, law.poisson), law.poisson, law.cohesion,
                               law.friction_angle * degree, law.dilation_angle * degree, law.tension_cutoff);
}

/// A symmetric tensor as a full matrix
template <std::size_t N>
std::array<std::array<double, 3>, 3> full(const std::array<double, N>& s)
{
  const double yz = N == 6 ? s[N - 2] : 0.0, xz = N == 6 ? s[N - 1] : 0.0;
  return {{{s[0], s[3], xz}, {s[3], s[1], yz}, {xz, yz, s[2]}}};
}

inline double norm(const std::array<std::array<double, 3>, 3>& matrix)
{
  double squares = 0;
  for (const auto& row : matrix)
    for (const double entry : row)
      squares += entry * entry;
  return std::sqrt(squares);
}

/// Random stresses of a few strengths, some with equal principal stresses, some huge
template <int D>
SymTensor<D> random_stress(std::mt19937_64& random, double scale)
{
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const double size = scale * std::pow(10.0, 2 * uniform(random) - 1) * (uniform(random) < 0.01 ? 1e6 : 1.0);
  const double mean = 2 * size * normal(random);
  SymTensor<D> stress{};
  const double kind = uniform(random);
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    stress[k] = size * normal(random);
  if (kind < 0.05) // principal axes are the coordinate axes
    for (std::size_t k = 3; k < n_stress<D>; ++k)
      stress[k] = 0;
  if (kind < 0.02)
    stress[1] = stress[0];
  if (kind < 0.01)
    stress[2] = stress[0];
  for (std::size_t k = 0; k < 3; ++k)
    stress[k] += mean;
  return stress;
}
} // namespace mpm::test
