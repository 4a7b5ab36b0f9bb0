#pragma once
/// @file
/// Small-strain stiffness of the Hardening Soil law, for one point or for a few side by side (`Lanes`).
///
/// The strain drags a row of bricks behind it, each by a string. While the string of a brick is slack, the brick rests
/// and adds a part to the shear modulus. After a reversal all bricks rest until the strain has gone twice as far as
/// their strings are long, which is Masing's rule; a smaller cycle inside a larger one leaves no trace. In explicit
/// steps, whose waves load and unload all the time, a stiffness that every reversal brings back would never fall.
///
/// The strings are so long that the stress of first loading follows tangents of the curve
///     G = G0 / (1 + 0.385 gamma / gamma_0.7), gamma = sqrt(3/2 e : e), which is e_1 - e_3 in a triaxial test,
/// until its tangent modulus is that of unloading.
///
/// Source: Cudny, Truty (2020), Acta Geotechnica 15, 2031-2051, after Simpson (1992), Geotechnique 42, 541-576; the
/// curve: Santos, Correia (2001), Proc. 15th ICSMGE, 267-270. Distances are dragged along straight increments, over
/// which moduli and 1 / H_i are integrated.

#include "materials/laws/batch.h"
#include "materials/tools/deviator.h"
#include "materials/tools/dual.h"

#include <cmath>

namespace mpm::materials::hardening_soil
{
/// x^y of a positive number
template <class N>
N power(const N& x, double y)
{
  return each(x, [y](double number) { return falling_exponential(-y * natural_logarithm(number)); });
}

inline constexpr std::size_t n_bricks = 10;
/// Components of a distance that are states, by their number among those of a stress; zz follows from the trace.
inline constexpr std::array<std::size_t, 5> brick_components{0, 1, 3, 4, 5};
inline constexpr std::array brick_component_names{"xx", "yy", "xy", "yz", "xz"};
/// Columns of the states: the largest distance of the last brick, and the distances of all
inline constexpr std::size_t largest_column = 3, first_brick_column = 4;

/// Constants of the bricks
struct SmallStrain
{
  double ratio = 1;                         ///< G0 over the shear modulus of unloading; 1 stands for no bricks
  double exponent = 0;                      ///< of the tangent modulus in H_i, 1 + E_ur / (2 E50)
  std::array<double, n_bricks> strings{};   ///< lengths, from the shortest on [-]
  std::array<double, n_bricks> stiffness{}; ///< what a brick at rest adds to the modulus, over that of unloading

  bool exists() const { return ratio > 1; }
  /// The strain from which on the modulus is that of unloading [-]
  double end() const { return strings.back(); }
};

/// @param ratio      G0 over the shear modulus of unloading
/// @param threshold  gamma_0.7
inline SmallStrain bricks_of(double ratio, double threshold, double exponent)
{
  SmallStrain small{ratio, exponent, {}, {}};
  // Tangents where 1 / (1 + 0.385 gamma / gamma_0.7) falls by equal steps; the string ends where two of them meet.
  const auto slope_root = [&](std::size_t k) { return 1 + (1 / std::sqrt(ratio) - 1) * double(k) / double(n_bricks); };
  for (std::size_t k = 0; k < n_bricks; ++k)
  {
    const double before = slope_root(k), after = slope_root(k + 1);
    small.strings[k] = threshold / 0.385 * (2 / (before + after) - 1);
    small.stiffness[k] = ratio * (before * before - after * after);
  }
  return small;
}

template <int D, class N>
using Distance = std::array<N, n_stress<D>>;

/// Number of components of a distance that are states in D dimensions
template <int D>
inline constexpr std::size_t n_components = D == 2 ? 3 : 5;

template <int D, class N>
Distance<D, N> distance_of(const PointBatch<D>& points, Index i, std::size_t brick)
{
  Distance<D, N> distance;
  for (std::size_t k = 0; k < n_components<D>; ++k)
    distance[brick_components[k]] =
        load_as<N>(points.state[first_brick_column + brick * brick_components.size() + k] + i);
  distance[2] = -distance[0] - distance[1];
  return distance;
}

/// sqrt(3/2 e : e)
template <int D, class N>
N size_of(const Distance<D, N>& e)
{
  return root(N(1.5 * product<D, N>(e, e)));
}

/// A brick that an increment of the strain drags
template <int D, class N>
struct Dragged
{
  Distance<D, N> before, moved; ///< distances at the start, and as if the string had no end
  N share;                      ///< of `moved` that is left at the end, below 1 where the string is taut
};

/// @param strain  deviator of the strain increment, tensor components
template <int D, class N>
Dragged<D, N> dragged(const SmallStrain& small, const PointBatch<D>& points, Index i, const Distance<D, N>& strain,
                      std::size_t brick)
{
  Dragged<D, N> result{distance_of<D, N>(points, i, brick), {}, {}};
  for (std::size_t k = 0; k < n_stress<D>; ++k)
    result.moved[k] = result.before[k] + strain[k];
  const N size = size_of<D, N>(result.moved), end = N{} + small.strings[brick];
  result.share = chosen<N>(size > end, end / size, N{} + 1);
  return result;
}

/// The part of an increment over which a brick whose string is taut rests
/// @param square  strain : strain
template <int D, class N>
N resting_part(const Dragged<D, N>& one, const Distance<D, N>& strain, const N& square)
{
  const N part = one.share - (1 - one.share) * product<D, N>(one.before, strain) / square;
  return larger<N>(smaller<N>(part, N{} + 1), N{});
}

/// What an increment has of the small-strain stiffness
template <class N>
struct Stiffening
{
  N stiffness; ///< mean of the modulus while plastic strain develops, over that of unloading
  N strain;    ///< by how much the strain increment counts for more than in the increment with that modulus throughout
  N softening; ///< plastic strain over that without small-strain stiffness, 1 / H_i
};

/// 1 / H_i at a distance, and its integral from zero on
template <class N>
std::pair<N, N> softening_at(const SmallStrain& small, const N& distance)
{
  const double rate = (std::sqrt(small.ratio) - 1) / small.end(), power_of = 2 * small.exponent;
  const N bounded = smaller<N>(distance, N{} + small.end());
  const double least = std::pow(small.ratio, -small.exponent);
  const N growth = 1 + rate * bounded, softening = least * power(growth, power_of);
  const N integral = (softening * growth - least) / (rate * (power_of + 1));
  return {softening, integral + (distance - bounded)};
}

/// The largest distance of the last brick before an increment and after it, as if its string had no end
template <class N>
struct Largest
{
  N before, after;

  N change() const { return after - before; }
};

template <int D, class N>
Largest<N> largest_of(const PointBatch<D>& points, Index i, const Dragged<D, N>& last)
{
  const N before = load_as<N>(points.state[largest_column] + i);
  return {before, larger<N>(before, size_of<D, N>(last.moved))};
}

/// Change of the largest distance below which 1 / H_i is that of the middle all the time
inline double small_change(const SmallStrain& small) { return 1e-6 * small.end(); }

/// Integral of 1 / H_i over the first part of an increment, of which the distance grows evenly
/// @param part  from 0 to 1
template <class N>
N softening_until(const SmallStrain& small, const Largest<N>& largest, const N& part)
{
  const Mask<N> is_small = largest.change() < small_change(small);
  const N middle = part * softening_at<N>(small, 0.5 * (largest.before + largest.after)).first;
  const N sum = softening_at<N>(small, largest.before + part * largest.change()).second -
                softening_at<N>(small, largest.before).second;
  return chosen<N>(is_small, middle, sum / largest.change());
}

/// The increment goes along a straight line, on which a brick rests before its string is taut. With the modulus s and
/// the plastic strains of the law without bricks times h = 1 / H_i, the stress grows by the integral of s (de - h dP),
/// so that over an increment it is mean(s) e - mean(s h) / mean(h) e_p with its plastic strain e_p.
template <int D, class N>
Stiffening<N> stiffening_of(const SmallStrain& small, const PointBatch<D>& points, Index i,
                            const Distance<D, N>& strain)
{
  const N one = N{} + 1;
  if (!small.exists())
    return {one, one, one};
  const N square = product<D, N>(strain, strain);
  const Largest<N> largest = largest_of<D, N>(points, i, dragged<D, N>(small, points, i, strain, n_bricks - 1));
  const N softening = softening_until(small, largest, one);
  N mean = one, plastic = softening;
  for (std::size_t brick = 0; brick < n_bricks; ++brick)
  {
    const Dragged<D, N> each_one = dragged<D, N>(small, points, i, strain, brick);
    const Mask<N> is_dragged = (each_one.share < 1) & (square > 0);
    const N part = chosen<N>(is_dragged, resting_part<D, N>(each_one, strain, square), one);
    mean = mean + small.stiffness[brick] * part;
    plastic =
        plastic + small.stiffness[brick] * chosen<N>(is_dragged, softening_until(small, largest, part), softening);
  }
  const N stiffness = plastic / softening;
  return {stiffness, mean / stiffness, softening};
}

/// Derivatives of a stiffening by the strain increment, of engineering shear
template <int D>
struct StiffeningSlopes
{
  SymTensor<D> stiffness{}, strain{}, softening{};
};

template <int D>
StiffeningSlopes<D> stiffening_slopes(const SmallStrain& small, const PointBatch<D>& points, Index i,
                                      const SymTensor<D>& strain)
{
  StiffeningSlopes<D> slopes;
  const double square = product<D>(strain, strain);
  if (!small.exists() || !(square > 0))
    return slopes;
  const Dragged<D, double> last = dragged<D, double>(small, points, i, strain, n_bricks - 1);
  const Largest<double> largest = largest_of<D, double>(points, i, last);
  const bool grows = largest.change() >= small_change(small);
  const double softening = softening_until(small, largest, 1.0);
  SymTensor<D> by_mean{}, by_plastic{}, by_largest{};
  for (std::size_t k = 0; k < n_stress<D> && grows; ++k)
    by_largest[k] = 1.5 * last.moved[k] / largest.after;
  // Derivative of the integral over the first part by the largest distance at the end, at a fixed part
  const auto slope_until = [&](double part)
  {
    const double here = softening_at(small, largest.before + part * largest.change()).first;
    return grows ? (part * here - softening_until(small, largest, part)) / largest.change() : 0.0;
  };
  double mean = 1, plastic = softening, plastic_by_largest = slope_until(1.0);
  for (std::size_t brick = 0; brick < n_bricks; ++brick)
  {
    const Dragged<D, double> one = dragged<D, double>(small, points, i, strain, brick);
    const double part = one.share < 1 ? resting_part<D, double>(one, strain, square) : 1.0;
    mean += small.stiffness[brick] * part;
    plastic += small.stiffness[brick] * softening_until(small, largest, part);
    plastic_by_largest += small.stiffness[brick] * slope_until(part);
    if (!(one.share < 1 && part > 0))
      continue;
    const double along = product<D>(one.moved, strain), size = product<D>(one.moved, one.moved);
    const double here = grows ? softening_at(small, largest.before + part * largest.change()).first : softening;
    for (std::size_t k = 0; k < n_stress<D>; ++k)
    {
      // of the rest of the distance, share * moved - before, along the strain
      const double turned = one.share * (strain[k] - along / size * one.moved[k]);
      const double rest = one.share * one.moved[k] - one.before[k];
      const double by_part = (turned + rest - 2 * part * strain[k]) / square;
      by_mean[k] += small.stiffness[brick] * by_part;
      by_plastic[k] += small.stiffness[brick] * here * by_part;
    }
  }
  const double stiffness = plastic / softening;
  for (std::size_t k = 0; k < n_stress<D>; ++k)
  {
    slopes.softening[k] = slope_until(1.0) * by_largest[k];
    slopes.stiffness[k] =
        (by_plastic[k] + plastic_by_largest * by_largest[k] - stiffness * slopes.softening[k]) / softening;
    slopes.strain[k] = (by_mean[k] - mean / stiffness * slopes.stiffness[k]) / stiffness;
  }
  return slopes;
}

/// Writes the distances at the end of an increment.
template <int D, class N>
void drag(const SmallStrain& small, const PointBatch<D>& points, Index i, const Distance<D, N>& strain)
{
  for (std::size_t brick = 0; brick < n_bricks; ++brick)
  {
    const Dragged<D, N> one = dragged<D, N>(small, points, i, strain, brick);
    if (brick + 1 == n_bricks)
      store(smaller<N>(largest_of<D, N>(points, i, one).after, N{} + small.end()), points.state[largest_column] + i);
    for (std::size_t k = 0; k < n_components<D>; ++k)
      store(one.share * one.moved[brick_components[k]],
            points.state[first_brick_column + brick * brick_components.size() + k] + i);
  }
}
} // namespace mpm::materials::hardening_soil
