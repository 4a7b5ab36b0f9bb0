#pragma once
/// @file
/// Dashpots and springs at the nodes of absorbing sides.

#include "base/tensor.h"

#include <algorithm>
#include <vector>

namespace mpm::transfer
{
/// A node on absorbing sides. Corner nodes have the sums over the sides that meet there.
template <int D>
struct DashpotNode
{
  Index node;
  Matrix<D> damping;      ///< integral of N (rho c_p n n + rho c_s (1 - n n)) over the facets [kg/s]
  Matrix<D> stiffness;    ///< of the springs [N/m]
  Vector<D> held;         ///< force that was there when the side began to absorb [N]
  Vector<D> displacement; ///< since then [m]
};

/// The velocity of a wave that comes up from below, over time; linear in between, zero outside.
template <int D>
struct IncomingWave
{
  std::vector<double> times;      ///< rising [s]
  std::vector<double> velocities; ///< at these times [m/s]
  Vector<D> direction{};          ///< of motion, of unit length

  Vector<D> at(double time) const
  {
    Vector<D> velocity{};
    if (times.empty() || time < times.front() || time > times.back())
      return velocity;
    const auto next = std::upper_bound(times.begin() + 1, times.end() - 1, time) - times.begin();
    const auto k = static_cast<std::size_t>(next);
    const double part = (time - times[k - 1]) / (times[k] - times[k - 1]);
    for (int a = 0; a < D; ++a)
      velocity[a] = direction[a] * ((1 - part) * velocities[k - 1] + part * velocities[k]);
    return velocity;
  }
};
} // namespace mpm::transfer
