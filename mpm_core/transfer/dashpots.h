#pragma once
/// @file
/// Dashpots and springs at the nodes of absorbing sides, and the motions on their other ends.

#include "mesh/mesh.h"

#include <algorithm>
#include <vector>

namespace mpm::transfer
{
/// A node on absorbing sides. It has one entry for the sides through which the incoming wave comes, with the sums over
/// those that meet there, and one for each free field beside it.
template <int D>
struct DashpotNode
{
  Index node;
  Matrix<D> damping;      ///< integral of N (rho c_p n n + rho c_s (1 - n n)) over the facets [kg/s]
  Matrix<D> stiffness;    ///< of the springs [N/m]
  Vector<D> held;         ///< force that was there when the side began to absorb [N]; in one entry of a node
  Vector<D> displacement; ///< since then, relative to the free field [m]
  Index free_field;       ///< number of that beside the node; `none` where the incoming wave comes through
  double area;            ///< integral of N over the facets [m^(D-1)]
  bool is_rigid;          ///< the node moves with twice the incoming wave
  double response = 1;    ///< found in runs: change of the velocity of the particles at the node over that of the node
};

/// Place of a number among rising ones: the numbers k and k + 1 beside it, and how far it is from the first to the
/// second, from 0 to 1.
struct Bracket
{
  std::size_t k;
  double part;
};
inline Bracket bracket(const std::vector<double>& rising, double value)
{
  if (rising.size() < 2)
    return {0, 0};
  const auto next = std::upper_bound(rising.begin() + 1, rising.end() - 1, value) - rising.begin();
  const auto k = static_cast<std::size_t>(next) - 1;
  return {k, std::clamp((value - rising[k]) / (rising[k + 1] - rising[k]), 0.0, 1.0)};
}

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
    const auto [k, part] = bracket(times, time);
    for (int a = 0; a < D; ++a)
      velocity[a] = direction[a] * ((1 - part) * velocities[k] + part * velocities[k + 1]);
    return velocity;
  }
};

/// Level ground beside a side: how it moves, and how it pushes on the side.
template <int D>
struct FreeField
{
  struct State
  {
    Vector<D> velocity; ///< [m/s]
    Vector<D> traction; ///< on the side, since it began to absorb [Pa]
  };
  std::vector<double> heights; ///< rising, along the last axis [m]
  std::vector<double> times;   ///< rising [s]; the first or last state holds outside
  std::vector<State> states;   ///< (times, heights)

  /// The states at all heights.
  std::vector<State> at(double time) const
  {
    const auto [k, part] = bracket(times, time);
    const std::size_t n = heights.size(), next = k + 1 < times.size() ? k + 1 : k;
    std::vector<State> found(n);
    for (std::size_t i = 0; i < n; ++i)
      found[i] = between(states[k * n + i], states[next * n + i], part);
    return found;
  }

  static State between(const State& first, const State& second, double part)
  {
    State state;
    for (int a = 0; a < D; ++a)
    {
      state.velocity[a] = (1 - part) * first.velocity[a] + part * second.velocity[a];
      state.traction[a] = (1 - part) * first.traction[a] + part * second.traction[a];
    }
    return state;
  }
};
} // namespace mpm::transfer
