#pragma once
/// @file
/// The pore water of an implicit step, as plain data; docs/implicit.md has the equations (W1) to (W4).

#include "mesh/mesh.h"

#include <numeric>

namespace mpm::implicit
{
/// What a cell's particles contribute to the flow of water over a step, by its vertices.
template <int D>
struct PoreCell
{
  double pressure;                ///< sum V p at the start [N m]
  double flux;                    ///< sum V k dt / gamma_w [m5/Pa]
  double compliance;              ///< sum V (1 / M + n / K_w), of the soil without drainage [m3/Pa]
  double grains;                  ///< largest 1 - n of its particles: a volume below that has no pores
  std::array<double, D + 1> mean; ///< W_k = sum V N_k [m3]
  /// Volume of water by the pressure increments: storage, and the pressure projection [m3/Pa]
  std::array<std::array<double, D + 1>, D + 1> capacity;
  /// Volume of water that leaves at the free surface, by the pressures at the end [m3/Pa]
  std::array<std::array<double, D + 1>, D + 1> outflow;
};

/// Flow of the pore water over a step. The unknowns are pressure increments dp = dt rate at the nodes.
template <int D>
struct PoreStep
{
  bool flows = false; ///< whether pressures are unknowns of the step; otherwise they stay as they are
  double unit = 1;    ///< of the pressures in the linear system [Pa]
  double density = 0; ///< of water [kg/m3]
  Vector<D> gravity{};
  std::vector<PoreCell<D>> cells;  ///< of each owned cell
  std::vector<double> ghosts;      ///< weight of each stabilised facet [m5/Pa]
  std::vector<double> start;       ///< pressure of each node at the start [Pa]
  std::vector<double> rate;        ///< of the iterate [Pa/s]
  std::vector<unsigned char> held; ///< per node: 1 where its pressure is prescribed
  std::vector<double> prescribed;  ///< that pressure [Pa]
  std::vector<double> content;     ///< water that the soil takes up less what flows to it [m3], over all ranks
};

/// Volume of the particles of a cell: its vertices' parts together [m3].
template <int D>
inline double volume_of(const PoreCell<D>& cell)
{
  return std::accumulate(cell.mean.begin(), cell.mean.end(), 0.0);
}

/// Pressure of a node at the end of the step, under the iterate [Pa].
template <int D>
inline double end_pressure(const PoreStep<D>& pore, Index node, double dt)
{
  return pore.start[static_cast<std::size_t>(node)] + dt * pore.rate[static_cast<std::size_t>(node)];
}
} // namespace mpm::implicit
