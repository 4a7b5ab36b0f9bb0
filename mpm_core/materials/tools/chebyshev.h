#pragma once
/// @file
/// An explicit method for equations with widely spread real eigenvalues, such as those of plasticity with a narrow
/// yield surface: Runge-Kutta-Chebyshev of second order. With s stages its steps may be about 2/3 s^2 over the largest
/// eigenvalue, for 2 with each stage of the explicit Euler method.
/// Source: Sommeijer, Shampine, Verwer (1998), J. Comput. Appl. Math. 88, 315-326, eqs. (2.4)-(2.10).

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <tuple>

namespace mpm::materials
{
/// Number of stages for a step whose length is `stiffness` over the largest eigenvalue
inline int chebyshev_stages(double stiffness)
{
  return 1 + static_cast<int>(std::ceil(std::sqrt(1 + 1.54 * std::max(stiffness, 0.0))));
}

/// Chebyshev polynomial of degree j with its derivatives
struct Chebyshev
{
  double value, slope, curvature;

  /// That of the next degree
  Chebyshev next(const Chebyshev& before, double x) const
  {
    return {2 * x * value - before.value, 2 * value + 2 * x * slope - before.slope,
            4 * slope + 2 * x * curvature - before.curvature};
  }
  double weight() const { return curvature / (slope * slope); } ///< b_j
};

/// What a function makes of each number of states that consist of numbers only, in one pass over them.
template <class Function, class Y, class... More>
Y by_number(Function&& function, const Y& y, const More&... more)
{
  using Row = std::array<double, sizeof(Y) / sizeof(double)>;
  const auto rows = std::tuple{std::bit_cast<Row>(y), std::bit_cast<Row>(more)...};
  Row result;
  for (std::size_t i = 0; i < result.size(); ++i)
    result[i] = std::apply([&](const auto&... row) { return function(row[i]...); }, rows);
  return std::bit_cast<Y>(result);
}

/// Takes a step.
/// @tparam Y     a struct of numbers (double)
/// @param rate   of y at its start
/// @param rates  gives the rate of a y
/// @param keep   puts a stage into the domain of the rates
template <class Y, class Rates, class Keep>
Y chebyshev_step(const Y& y, const Y& rate, double step, int stages, Rates&& rates, Keep&& keep)
{
  const double x = 1 + 2.0 / (13.0 * stages * stages);
  Chebyshev before{1, 0, 0}, at{x, 1, 0};
  for (int j = 2; j <= stages; ++j)
  {
    const Chebyshev next = at.next(before, x);
    before = at;
    at = next;
  }
  const double per_slope = at.slope / at.curvature; // w_1

  before = {1, 0, 0};
  at = {x, 1, 0};
  const double first = at.next(before, x).weight(); // b_0 = b_1 = b_2
  double weight_before = first, weight = first;
  const auto begun = [f = first * per_slope * step](double y0, double r) { return y0 + f * r; };
  Y last = y, now = by_number(begun, y, rate);
  keep(now);
  for (int j = 2; j <= stages; ++j)
  {
    const Chebyshev next = at.next(before, x);
    const double b = next.weight(), mu = 2 * b * x / weight, nu = -b / weight_before;
    const double of_rate = 2 * b * per_slope / weight, a = 1 - weight * at.value;
    // (1 - mu - nu) y + mu now + nu last, in differences from y, which do not round away small steps
    const auto continued = [mu, nu, c = of_rate * step, a](double y0, double y1, double y2, double r1, double r0)
    { return y0 + mu * (y1 - y0) + nu * (y2 - y0) + c * r1 - a * c * r0; };
    Y stage = by_number(continued, y, now, last, rates(now), rate);
    keep(stage);
    last = now;
    now = stage;
    weight_before = weight;
    weight = b;
    before = at;
    at = next;
  }
  return now;
}
} // namespace mpm::materials
