#pragma once
/// @file
/// Where the time of the steps goes.

#include <array>
#include <chrono>

namespace mpm
{
/// The phases of an explicit step
enum class Phase
{
  node_sums, ///< from cells to nodes, with their exchange between ranks
  momentum,  ///< momentum equation, and work done
  mapping,   ///< velocities mapped back to the nodes (19), with their exchange
  averaging, ///< of volumetric strains (nodal mixed discretisation)
  particles, ///< the pass over the particles
  settling   ///< migration, sorting
};
inline constexpr std::array phase_names{"node sums", "momentum", "mapping", "averaging", "particles", "settling"};

/// Seconds spent in each phase
using PhaseSeconds = std::array<double, phase_names.size()>;

/// Adds the time of its life to a phase: two looks at a clock, some 50 ns.
class PhaseTimer
{
public:
  PhaseTimer(PhaseSeconds& seconds, Phase phase)
      : _seconds(seconds[static_cast<std::size_t>(phase)]), _start(std::chrono::steady_clock::now())
  {
  }
  ~PhaseTimer() { _seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - _start).count(); }
  PhaseTimer(const PhaseTimer&) = delete;
  PhaseTimer& operator=(const PhaseTimer&) = delete;

private:
  double& _seconds;
  std::chrono::steady_clock::time_point _start;
};
} // namespace mpm
