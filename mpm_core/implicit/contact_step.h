#pragma once
/// @file
/// Contact with rigid surfaces in an implicit step, as plain data.

#include "contact/end_of_step.h"

namespace mpm::implicit
{
/// Particle that touches a surface in the trial.
template <int D>
struct TouchingParticle
{
  Index particle, cell;
  EndTouch<D> touch;
  Spring spring;
  WaterShare water;
  EndRadius radius;
  Vector<D> displacement;          ///< in the step [m]
  std::array<double, D + 1> share; ///< of the force that each vertex of its cell takes
};

/// A surface in the trial.
template <int D>
struct TrialContact
{
  RigidBody<D> end; ///< the body at the end of the stage
  std::vector<TouchingParticle<D>> touching;
  Vector<D> before{}; ///< force on the body at the end of the first of two stages, of this rank's particles [N]
};

/// What the particles of a cell that touch surfaces add to the tangent.
template <int D>
struct CellContact
{
  std::array<std::array<Matrix<D>, D + 1>, D + 1> blocks{}; ///< -df/du between vertices, at constant volumetric strain
  std::array<Vector<D>, D + 1> by_volumetric{};             ///< -df/d theta of the vertices, by that strain of the cell
  std::array<std::array<Vector<D>, D + 1>, D + 1> by_water{}; ///< df/dp of the first by the pressure of the second
};

/// An axis along which forces move a body, or about which they rotate it; see driven_bodies.h.
template <int D>
struct DrivenAxis
{
  std::size_t surface; ///< number of the body
  int axis;            ///< x, y (and z), then the axes of rotation: z, or x, y and z
  double mass;         ///< [kg]; 0 where the load is controlled
  double length = 1;   ///< of a rotation: the radius of gyration [m], by which it becomes a way and its moment a force
  double start = 0;    ///< velocity at the step's start [m/s]
  double velocity = 0; ///< the iterate [m/s]
  double applied = 0;  ///< force and weight at the step's end [N]
  double inertia = 0;  ///< of a rotation at constant spin, and its change of momentum over dt [N]
  double residual = 0; ///< R [N]
  std::vector<Vector<D>> column{};     ///< of B, at the nodes [N/m]
  std::vector<Vector<D>> row{};        ///< of C [N/m]
  std::vector<double> row_by_strain{}; ///< the part of C by the nodes' averaged volumetric strains, by group [N]
};

/// All such axes, those of a body one after the other.
template <int D>
struct DrivenBodies
{
  std::vector<DrivenAxis<D>> axes;
  std::vector<double> block; ///< E, row by row [N/m]
};

/// Shape functions of a cell's vertices at a particle.
template <int D>
std::array<double, D + 1> weights_at(const CellShape<D>& shape, const Vector<D>& x)
{
  std::array<double, D + 1> weights;
  for (std::size_t k = 0; k <= D; ++k)
    weights[k] = 1.0 / (D + 1) + dot<D>(shape.gradient[k], difference<D>(x, shape.centre));
  return weights;
}

template <int D>
struct ContactStep
{
  std::vector<ContactModuli> moduli;     ///< means of the soil in each owned cell at the step's start
  std::vector<TrialContact<D>> surfaces; ///< as many as the model has
  std::vector<Vector<D>> forces;         ///< at nodes, this rank's part [N]
  std::vector<CellContact<D>> cells;     ///< those with touching particles [N/m]
  std::vector<Index> number_of_cell;     ///< in `cells`, per owned cell, or `none`; empty without surfaces

  /// What touches in a cell; null where nothing does.
  const CellContact<D>* in(Index cell) const
  {
    const Index number = number_of_cell.empty() ? none : number_of_cell[static_cast<std::size_t>(cell)];
    return number == none ? nullptr : &cells[static_cast<std::size_t>(number)];
  }
};
} // namespace mpm::implicit
