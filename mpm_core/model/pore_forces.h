#pragma once
/// @file
/// Forces of the pore pressures of the particles at the nodes.

#include "model/pore_water.h"
#include "model/velocity_field.h"

namespace mpm::model
{
/// Pressure p_s of the water that stands over the soil, linear in a cell as that of finite elements is.
template <int D>
struct StandingWater
{
  std::array<double, D + 1> pressure; ///< at the vertices [Pa]
  Vector<D> gradient;                 ///< [Pa/m]
};

template <int D>
inline StandingWater<D> standing_water(const Mesh<D>& mesh, const PoreWater& water, Index cell)
{
  StandingWater<D> standing{};
  for (int k = 0; k <= D && !water.standing.empty(); ++k)
  {
    standing.pressure[k] = standing_pressure(water, mesh.points[mesh.cells[cell][k]][D - 1]);
    for (int a = 0; a < D; ++a)
      standing.gradient[a] += standing.pressure[k] * mesh.shapes[cell].gradient[k][a];
  }
  return standing;
}

template <int D>
inline double pressure_at(const StandingWater<D>& standing, const std::array<double, D + 1>& shape)
{
  double pressure = 0;
  for (int k = 0; k <= D; ++k)
    pressure += standing.pressure[k] * shape[k];
  return pressure;
}

/// Part of the total stress of the particles of a cell beside their effective stresses. Water that stands over the free
/// surface presses on it by p_s, wherever the surface is: div(s - p_a I) + rho g with p_a = p_s there is the same as
/// div(s - (p_a - p_s) I) + rho g - grad p_s with no load there.
template <int D>
struct PoreLoad
{
  double pressure;                  ///< sum V (S_e p - p_s) [N m]
  double standing;                  ///< sum V p_s [N m]
  std::array<double, D + 1> volume; ///< sum V N_k, where water stands [m3]
  Vector<D> gradient;               ///< of p_s [Pa/m]
};

/// Where a particle is from the place of its row: of a resting cell, the centre of mass of its particles.
template <class G, int D = G::dim>
inline Vector<D> offset_of_mass(const Particles<D>& particles, Index p, const CellMoments<G>& moments)
{
  Vector<D> offset{};
  if (is_resting(particles, p))
    for (int a = 0; a < D; ++a)
      offset[a] = moments.mass_xi[a] / moments.mass;
  return offset;
}

/// Adds a particle of a law to its cell's.
template <class G, int D = G::dim>
inline void add_pore_load(const CellShape<D>& shape, const Particles<D>& particles, const PoreWater& water,
                          const StandingWater<D>& standing, const CellMoments<G>& moments, Index material, Index p,
                          double volume, PoreLoad<D>& load)
{
  const Vector<D> offset = offset_of_mass(particles, p, moments);
  double pressure = particles.pore_pressure[0][p];
  if (is_resting(particles, p))
    pressure += dot<D>(at<D>(particles.pressure_gradient.columns, p), offset);
  if (water.may_dry())
    pressure = acting_pressure(water.retention[static_cast<std::size_t>(material)], pressure);
  if (!water.standing.empty())
  {
    Vector<D> place = at<D>(particles.position, p);
    for (int a = 0; a < D; ++a)
      place[a] += offset[a];
    const auto n = shape_functions<D>(shape, place);
    const double above = pressure_at<D>(standing, n);
    pressure -= above;
    load.standing += volume * above;
    for (int k = 0; k <= D; ++k)
      load.volume[k] += volume * n[k];
    load.gradient = standing.gradient;
  }
  load.pressure += volume * pressure;
}

/// Adds the internal forces of pore pressures, -B^T sum V_p (S_e p - p_s), to those of the stresses of a field, and the
/// weight that standing water takes; this rank's part. Nothing where water has its own velocity, which `water_to_nodes`
/// looks after.
/// @pre the internal forces of the stresses have been integrated: with mixed integration the full cells are known
template <class G, int D = G::dim>
void add_pore_forces(const Mesh<D>& mesh, const Particles<D>& particles, const PoreWater& water,
                     const std::vector<Run>& runs, VelocityField<G>& field);

/// Adds the forces of water that stands over the free surface to the tractions, -sum V_p (p_s grad N + N grad p_s), of
/// soil and water together; this rank's part. The pressures are integrated as those of the field of the water are, and
/// the weight over the particles, as that of soil and water is.
template <class G, int D = G::dim>
void add_standing_forces(const Mesh<D>& mesh, const Particles<D>& particles, const PoreWater& water,
                         const std::vector<Run>& runs, const VelocityField<G>& field, Array<NodeSums<D>>& nodes);

/// Adds the forces of pressures on the surface of the soil to the tractions, those of standing water among them; this
/// rank's part. On facets between filled cells those from both sides cancel.
/// @param acting  which of the conditions: `&PressureCondition::presses`, or those that hold the pressure of the water
template <class G>
void add_surface_pressures(const Mesh<G::dim>& mesh, const PoreWater& water, bool PressureCondition::*acting,
                           VelocityField<G>& field);
} // namespace mpm::model
