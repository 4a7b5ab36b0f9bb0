#pragma once
/// @file
/// The pore water of an implicit step, as plain data; docs/implicit.md has the equations (W1) to (W4).

#include "contact/water_share.h"
#include "model/pore_forces.h"

#include <numeric>

namespace mpm::implicit
{
/// What a cell's particles contribute to the flow of water over a step, by its vertices.
template <int D>
struct PoreCell
{
  PoreLoad<D> load;               ///< of the pressures at the start, and of standing water
  Matrix<D> flux;                 ///< sum V k dt / gamma_w, symmetric [m5/Pa]
  double compliance;              ///< sum V (1 / M + n / K_w), of the soil without drainage [m3/Pa]
  double grains;                  ///< largest 1 - n of its particles: a volume below that has no pores
  std::array<double, D + 1> mean; ///< W_k = sum V N_k [m3]
  /// Volume of water by the pressure increments: storage, and the pressure projection [m3/Pa]
  std::array<std::array<double, D + 1>, D + 1> capacity;
};

/// What the particles of a cell whose soil may dry contribute under the iterate, in the place of the sums at the start.
template <int D>
struct DryingCell
{
  double pressure;                       ///< sum V (S_e p - p_s) [N m]
  std::array<double, D + 1> by_pressure; ///< its derivatives by the pressures of the vertices [m3]
  std::array<double, D + 1> content;     ///< water that is stored by the end, less that at the start [m3]
  std::array<double, D + 1> wet;         ///< sum V S N_k, its derivatives by the volumetric strain [m3]
  std::array<std::array<double, D + 1>, D + 1> capacity; ///< and by the pressures, without the projection [m3/Pa]
  Matrix<D> flux;                                        ///< sum V k_r k dt / gamma_w, symmetric [m5/Pa]
  std::array<Matrix<D>, D + 1> flux_by_pressure;         ///< [m5/Pa2]
};

/// Means over the particles around a node, over all ranks, the pressure and the others by volume; plain doubles.
struct NodalWater
{
  double volume;     ///< sum V N_i [m3]
  double pressure;   ///< [Pa]
  double mobility;   ///< the largest k of any direction, over gamma_w [m4/Ns]
  double compliance; ///< of the soil without drainage [1/Pa]
};

/// A part of the free surface within a cell, by its middle.
template <int D>
struct SurfacePoint
{
  Index cell;
  std::array<double, D + 1> shape; ///< N_k there
  double weight;   ///< outflow over a step by the pressure above that of the water that stands there [m3/Pa]
  double standing; ///< pressure of that water [Pa]
  double rain;     ///< that falls in the step [m3]
  bool open;       ///< whether water also enters as the pressure says: under standing water
  bool takes_rain; ///< whether it does not, and takes no more than the rain; see `revise_surface`
};

/// Flow of the pore water over a step. The unknowns are pressure increments dp = dt rate at the nodes.
template <int D>
struct PoreStep
{
  bool drained = false; ///< whether water leaves at the free surface
  bool flows = false;   ///< whether pressures are unknowns of the step; otherwise they stay as they are
  double unit = 1;      ///< of the pressures in the linear system [Pa]
  double length = 1;    ///< mean size of the cells with soil [m]; unit over it makes forces of volumes of water
  double density = 0;   ///< of water [kg/m3]
  Vector<D> gravity{};
  std::vector<PoreCell<D>> cells;    ///< of each owned cell
  std::vector<DryingCell<D>> drying; ///< likewise, under the iterate; empty where all soil stays saturated
  std::vector<SurfacePoint<D>> surface;
  std::vector<SoilAround<D>> around; ///< of each node: the surface of the soil
  std::vector<double> ghosts;        ///< weight of each stabilised facet [m5/Pa]
  std::vector<double> start;         ///< pressure of each node at the start [Pa]
  std::vector<double> rate;          ///< of the iterate [Pa/s]
  std::vector<unsigned char> held;   ///< per node: 1 where its pressure is prescribed
  std::vector<double> prescribed;    ///< that pressure [Pa]
  std::vector<double> content;       ///< water that the soil takes up less what flows to it [m3], over all ranks
  double flow_squares = 0; ///< of each owned cell: square of the water that the pressures of its nodes drive to and fro
                           ///< in the balance of `content`, where they nearly cancel [m6]
};

/// Water that a gradient drives through the soil of a cell, against another one: g . f h.
template <int D>
inline double flow(const Matrix<D>& flux, const Vector<D>& gradient, const Vector<D>& other)
{
  return dot<D>(gradient, product<D>(flux, other));
}

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

/// Pressure at a point of the free surface at the end of the step, under the iterate, over that of standing water [Pa].
template <int D>
inline double excess_pressure(const Mesh<D>& mesh, const PoreStep<D>& pore, const SurfacePoint<D>& point, double dt)
{
  double pressure = -point.standing;
  for (int k = 0; k <= D; ++k)
    pressure += point.shape[k] * end_pressure(pore, mesh.cells[point.cell][k], dt);
  return pressure;
}

/// Water that leaves at the surface over the step [m3]: as much as keeps the pressure close to that of standing water
/// or, where no water stands and the soil takes all the rain that falls, that rain.
template <int D>
inline double outflow_at(const SurfacePoint<D>& point, double excess)
{
  return point.takes_rain ? -point.rain : point.weight * excess;
}
} // namespace mpm::implicit
