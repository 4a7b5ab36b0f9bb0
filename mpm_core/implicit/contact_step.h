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
};

/// A surface in the trial.
template <int D>
struct TrialContact
{
  RigidBody<D> end; ///< the body at the end of the stage
  std::vector<TouchingParticle<D>> touching;
};

/// Blocks of the tangent between the vertices of a cell.
template <int D>
using CellBlocks = std::array<std::array<Matrix<D>, D + 1>, D + 1>;

template <int D>
struct ContactStep
{
  std::vector<TrialContact<D>> surfaces; ///< as many as the model has
  std::vector<Vector<D>> forces;         ///< at nodes, this rank's part [N]
  std::vector<CellBlocks<D>> blocks;     ///< of the cells with touching particles [N/m]
  std::vector<Index> block_of_cell;      ///< per owned cell, or `none`; empty without surfaces
};
} // namespace mpm::implicit
