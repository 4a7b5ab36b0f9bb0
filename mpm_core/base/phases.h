#pragma once
/// @file
/// Where the time of the steps goes.

#include <array>
#include <chrono>

namespace mpm::base
{
/// The phases of an explicit step
enum class Phase
{
  node_sums, ///< from cells to nodes, with their exchange between ranks
  momentum,  ///< momentum equation, and work done
  mapping,   ///< velocities mapped back to the nodes (19), with their exchange
  averaging, ///< of volumetric strains (nodal mixed discretisation)
  particles, ///< the pass over the particles
  migration  ///< of particles to other cells and ranks, sorting
};
inline constexpr std::array phase_names{"node sums", "momentum", "mapping", "averaging", "particles", "migration"};

/// Seconds spent in each phase
using PhaseSeconds = std::array<double, phase_names.size()>;

/// Adds the time between two phases to the one that ends: a look at a clock for each, some 25 ns.
class PhaseClock
{
public:
  explicit PhaseClock(PhaseSeconds& seconds) : _seconds(seconds), _start(std::chrono::steady_clock::now()) {}
  ~PhaseClock() { stop(); }
  PhaseClock(const PhaseClock&) = delete;
  PhaseClock& operator=(const PhaseClock&) = delete;

  void begin(Phase phase)
  {
    stop();
    _phase = static_cast<int>(phase);
  }

private:
  void stop()
  {
    const auto now = std::chrono::steady_clock::now();
    if (_phase >= 0)
      _seconds[static_cast<std::size_t>(_phase)] += std::chrono::duration<double>(now - _start).count();
    _start = now;
  }

  PhaseSeconds& _seconds;
  std::chrono::steady_clock::time_point _start;
  int _phase = -1;
};
} // namespace mpm::base
