#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::materials
{
/// A function's value at a place
struct Sample
{
  double x, f;
};

/// Root of a continuous function between two samples of unlike sign, to round-off in x. Never leaves the bracket, so it
/// cannot fail; takes some ten evaluations.
/// Source: Chandrupatla (1997), Advances in Engineering Software 28, 145-149.
template <class F>
double root_between(F&& f, Sample one, Sample other)
{
  Sample oldest = other;
  double fraction = 0.5;
  for (int evaluations = 0; evaluations < 200; ++evaluations)
  {
    const double x = one.x + fraction * (other.x - one.x);
    const Sample sample{x, f(x)};
    const bool replaces_one = (sample.f > 0) == (one.f > 0);
    oldest = replaces_one ? one : other;
    other = replaces_one ? other : one;
    one = sample;
    const Sample best = std::abs(other.f) < std::abs(one.f) ? other : one;
    const double least = 2 * std::numeric_limits<double>::epsilon() * std::abs(best.x) / std::abs(other.x - one.x);
    if (best.f == 0 || !(least <= 0.5))
      return best.x;
    const double xi = (one.x - other.x) / (oldest.x - other.x), phi = (one.f - other.f) / (oldest.f - other.f);
    const bool smooth = phi * phi < xi && (1 - phi) * (1 - phi) < 1 - xi; // inverse quadratic interpolation is safe
    fraction = smooth ? one.f / (other.f - one.f) * oldest.f / (other.f - oldest.f) +
                            (oldest.x - one.x) / (other.x - one.x) * one.f / (oldest.f - one.f) * other.f /
                                (oldest.f - other.f)
                      : 0.5;
    fraction = std::clamp(fraction, least, 1 - least);
  }
  return one.x;
}
} // namespace mpm::materials
