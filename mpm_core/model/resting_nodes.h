#pragma once
/// @file
/// Resting cells between steps: what their nodes hold of them, and when their rows learn of it.

#include "model/particle_pass.h"

namespace mpm::model
{
/// Finds the resting cells of a field from the runs of all rows, from which it takes theirs out.
template <class G, int D = G::dim>
void take_resting_runs(const Mesh<D>& mesh, std::vector<Run>& runs, VelocityField<G>& field);

/// Makes what a step needs of the resting cells of a field, and gives their nodes the sums of their moments.
/// @pre rows and moments are up to date
template <class G, int D = G::dim>
void make_resting_cells(const Mesh<D>& mesh, const Particles<D>& particles, VelocityField<G>& field);

/// Gives the rows of resting cells the velocities and displacements that their nodes have gained, and their moments.
template <class G>
void update_resting_rows(Model<G>& model);

/// Adds mass, momentum and internal force of resting cells to the sums at the nodes of a field, with forces of another
/// stress than that of their rows.
/// @param stress_of  what a cell integrates [N m]; a callable Index -> Working
template <class G, class StressOf>
void add_resting_sums(const Mesh<G::dim>& mesh, StressOf&& stress_of, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  for (Index i : field.resting.nodes)
  {
    field.nodes[i].mass += field.resting.sums[i].mass;
    for (int a = 0; a < D; ++a)
      field.nodes[i].momentum[a] += field.resting.sums[i].momentum[a];
  }
  for (const Run& run : field.resting.runs)
  {
    const Working<G> stress = stress_of(run.cell);
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> force = internal_force<G>(stress, mesh.shapes[run.cell], k);
      for (int a = 0; a < D; ++a)
        field.nodes[mesh.cells[run.cell][k]].internal[a] += force[a];
    }
  }
}

/// The part of the mesh whose cells have particles, with all nodes of the field.
template <class G>
const MeshPart& part_of_particles(VelocityField<G>& field);

/// Gives nodes what resting cells gain by the field's `velocity_change`: momentum, their mass matrix times it, added to
/// `momentum` as well, and velocities as (18), with the energy that PIC takes out of them. The rows learn of it later.
/// @param momentum  per node; may be empty
template <class G>
void gain_resting_momentum(Model<G>& model, double pic_fraction, VelocityField<G>& field,
                           std::span<Vector<G::dim>> momentum);

/// Adds the momentum that the nodes of a part would gain of resting cells by changes of nodal velocities.
template <class G>
void add_resting_momentum(const VelocityField<G>& field, std::span<const Vector<G::dim>> change, const MeshPart& part,
                          std::span<Vector<G::dim>> momentum);

/// Moves resting cells with their nodes, whose gains of the step are made now, unless they have been. With small
/// displacements, which take place without velocities, nothing is gained.
template <class G>
void move_resting_nodes(Model<G>& model, const PassOptions& options);
} // namespace mpm::model
