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
  Index particle;
  EndTouch<D> touch;
  Spring spring;
  EndRadius radius;
};

/// A surface in the trial.
template <int D>
struct TrialContact
{
  RigidBody<D> end; ///< the body at the end of the stage
  std::vector<TouchingParticle<D>> touching;
};

/// What the particles of a cell that touch surfaces add to the tangent.
template <int D>
struct CellContact
{
  std::array<std::array<Matrix<D>, D + 1>, D + 1> blocks{}; ///< -df/du between vertices, at constant volumetric strain
  std::array<Vector<D>, D + 1> by_volumetric{};             ///< -df/d theta of the vertices, by that strain of the cell
};

template <int D>
struct ContactStep
{
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
