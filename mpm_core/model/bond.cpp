#include "model/bond.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mpm::model
{
namespace
{
/// The derivative of an energy by a force at some force; linear between such points, of which two at one force are a
/// jump.
struct Knot
{
  double force, derivative;
};

/// Knots by rising force; the energy is infinite beyond the first and the last of them.
using Derivative = std::vector<Knot>;

/// Value at a force between the first and the last knot.
double value_at(const Derivative& derivative, double force)
{
  const auto right = std::ranges::find_if(derivative, [force](const Knot& knot) { return knot.force >= force; });
  if (right == derivative.begin() || right->force == force)
    return right->derivative;
  const Knot& left = *(right - 1);
  const double part = (force - left.force) / (right->force - left.force);
  return left.derivative + part * (right->derivative - left.derivative);
}

/// The part of a derivative from one force to another.
Derivative within(const Derivative& all, double least, double largest)
{
  Derivative part;
  if (all.front().force < least)
    part.push_back({least, value_at(all, least)});
  for (const Knot& knot : all)
    if (knot.force >= least && knot.force <= largest)
      part.push_back(knot);
  if (all.back().force > largest)
    part.push_back({largest, value_at(all, largest)});
  return part;
}

/// The force at which the energy is least.
double least_energy(const Derivative& derivative)
{
  if (derivative.front().derivative >= 0)
    return derivative.front().force;
  for (std::size_t k = 0; k + 1 < derivative.size(); ++k)
  {
    const Knot &left = derivative[k], &right = derivative[k + 1];
    if (right.derivative >= 0)
      return left.force + (right.force - left.force) * -left.derivative / (right.derivative - left.derivative);
  }
  return derivative.back().force;
}

/// The derivative of the least energy if the force may still change by the strength of a bond: it is 0 around the
/// minimum.
Derivative across_bond(const Derivative& before, double minimum, double strength)
{
  Derivative after;
  for (const Knot& knot : before)
    if (knot.derivative < 0)
      after.push_back({knot.force - strength, knot.derivative});
  after.push_back({minimum - strength, 0});
  after.push_back({minimum + strength, 0});
  for (const Knot& knot : before)
    if (knot.derivative > 0)
      after.push_back({knot.force + strength, knot.derivative});
  return after;
}
} // namespace

std::vector<double> bond_strengths(const std::vector<double>& lengths, double strength, bool has_free_length,
                                   bool connected, bool fixed_end)
{
  const std::size_t segments = lengths.size(), first = has_free_length ? 1 : 0;
  std::vector<double> strengths;
  for (std::size_t node = 0; node <= segments; ++node)
  {
    const double before = node > first ? lengths[node - 1] : 0;
    const double after = node >= first && node < segments ? lengths[node] : 0;
    strengths.push_back(strength * 0.5 * (before + after));
  }
  if (connected)
    strengths.front() = std::numeric_limits<double>::infinity();
  if (fixed_end)
    strengths.back() = std::numeric_limits<double>::infinity();
  return strengths;
}

std::vector<double> forces_with_slip(const BondedBar& bar)
{
  const std::size_t segments = bar.force.size();
  // No force is beyond the largest one, or the strength of the bar: finite bounds in the place of infinite strengths.
  double bound = 0;
  for (const double force : bar.force)
    bound = std::max(bound, std::abs(force));
  std::vector<double> minima;
  Derivative derivative{{0, 0}, {0, 0}}; // beyond the first node: no force
  for (std::size_t k = 0; k < segments; ++k)
  {
    minima.push_back(least_energy(derivative));
    derivative = across_bond(derivative, minima.back(), std::min(bar.bond_strength[k], 2 * bound));
    derivative = within(derivative, std::max(bar.least[k], -bound), std::min(bar.largest[k], bound));
    for (Knot& knot : derivative)
      knot.derivative += (knot.force - bar.force[k]) / bar.stiffness[k];
  }
  minima.push_back(least_energy(derivative));
  // Back from beyond the last node, each force is as near to its minimum as the bond behind it lets it be.
  std::vector<double> forces(segments);
  double after = 0;
  for (std::size_t k = segments; k-- > 0; after = forces[k])
    forces[k] = std::clamp(minima[k + 1], after - bar.bond_strength[k + 1], after + bar.bond_strength[k + 1]);
  return forces;
}
} // namespace mpm::model
