#pragma once
/// @file
/// What explicit and implicit steps take from the particles at their start, and the strains that nodes give the cells.

#include "model/integration.h"
#include "model/model.h"

#include <algorithm>
#include <cmath>

namespace mpm::model
{
/// Sums of mass (11), momentum, internal force (14) and traction (15) at the nodes of a field, of this rank's
/// particles.
///
/// With nodal mixed discretisation the stresses are averaged as the strains will be, in each cell by the least fraction
/// that its soils have in `integration.averaged_by_law`: weighted by `averaged_volume`, the average is its own
/// transpose, so that the forces do the work of the particles' stresses on averaged strains.
/// @post cells that have become empty are left out of the field's part of the mesh, where it is to shrink
/// @note Collective where stresses are integrated over whole cells, or averaged
template <class G, int D = G::dim>
void particles_to_nodes(const Mesh<D>& mesh, NodeExchange& exchange, const Particles<D>& particles,
                        const std::vector<Run>& runs, VelocityField<G>& field);

/// The same for all fields of a model, over all ranks.
/// @pre prepare(model) has been called
/// @note Collective
template <class G>
void map_to_nodes(Model<G>& model);

/// Whether a node has too little mass to have a velocity of its own.
template <class G>
inline bool is_light(const VelocityField<G>& field, Index node)
{
  return !(field.nodes[node].mass > field.least_mass);
}

/// Mean of the values at the nodes of a cell that are not light.
template <class G>
Vector<G::dim> mean_of_heavy_nodes(const Mesh<G::dim>& mesh, const VelocityField<G>& field,
                                   const std::vector<Vector<G::dim>>& nodal, Index cell);

/// Calls visit(node, mean) for each light vertex of each cell with particles: its node, and the mean of the nodal
/// values of the other vertices.
template <class G, class Visit>
void for_each_light_vertex(const Mesh<G::dim>& mesh, const VelocityField<G>& field,
                           const std::vector<Vector<G::dim>>& nodal, Visit&& visit)
{
  for (Index c : field.part.cells)
    for (Index node : mesh.cells[c])
      if (field.moments[c].mass > 0 && is_light(field, node))
        visit(node, mean_of_heavy_nodes(mesh, field, nodal, c));
}

/// The velocity, or its change, at a vertex as the particles of a cell take it: that of its node, or, where the node is
/// light, the mean of the other vertices. Particles are then within round-off of the facet opposite to the node; they
/// would be strained at once if it stood still.
/// @param nodal  one of the nodal velocities of the field
template <class G>
inline Vector<G::dim> value_of_vertex(const Mesh<G::dim>& mesh, const VelocityField<G>& field,
                                      const std::vector<Vector<G::dim>>& nodal, Index cell, int k)
{
  const Index node = mesh.cells[cell][k];
  if (field.has_light_nodes && is_light(field, node)) [[unlikely]]
    return mean_of_heavy_nodes(mesh, field, nodal, cell);
  return nodal[node];
}

/// Calls work with `value_of_vertex`, a callable (nodal, cell, k) -> Vector<D>, decided once for all cells on whether
/// the field may have light nodes.
template <class G, class Work, int D = G::dim>
inline void with_values_of_vertices(const Mesh<D>& mesh, const VelocityField<G>& field, Work&& work)
{
  using Nodal = std::vector<Vector<D>>;
  if (field.has_light_nodes) [[unlikely]]
    work([&](const Nodal& nodal, Index cell, int k) -> Vector<D>
         { return value_of_vertex(mesh, field, nodal, cell, k); });
  else
    work([&](const Nodal& nodal, Index cell, int k) -> const Vector<D>& { return nodal[mesh.cells[cell][k]]; });
}

/// Makes nodal velocities satisfy the boundary conditions of a field.
/// @post field.imposed has the changes
template <class G>
inline void impose_supports(std::span<Vector<G::dim>> velocity, VelocityField<G>& field)
{
  field.imposed.resize(field.supports.size());
  for (std::size_t s = 0; s < field.supports.size(); ++s)
  {
    Vector<G::dim>& v = velocity[field.supports[s].node];
    const Vector<G::dim> before = v;
    impose<G::dim>(field.supports[s], v);
    for (int a = 0; a < G::dim; ++a)
      field.imposed[s][a] = v[a] - before[a];
  }
}

/// v_i at the start of the step, from the sums at nodes, under the boundary conditions.
template <class G>
void find_start_velocity(VelocityField<G>& field);

/// What the nodes add to the velocities of particles over dt [s]: dt a_i, and with a PIC fraction that much of the
/// grid's velocity, which takes the place of the particles' own.
template <class G>
void find_velocity_change(VelocityField<G>& field, double pic_fraction, double dt);

/// Volumetric strains of the nodes over dt [s] from nodal velocities, averages over the cells around them (nodal mixed
/// discretisation).
/// @param nodal  one of the nodal velocities of the field
/// @note Collective
template <class G, int D = G::dim>
void average_strains(const Mesh<D>& mesh, NodeExchange& exchange, const std::vector<Vector<G::dim>>& nodal, double dt,
                     VelocityField<G>& field);

/// Mean stress of the particles of a cell as it acts on the nodes [Pa]: with averages where the forces have them.
/// @pre `particles_to_nodes` has been called for the field
template <class G, int D = G::dim>
Working<G> acting_stress(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell);

/// Averages the mean of the normal components of the cells' stress times volume, as strains are averaged.
///
/// The forces of these stresses do the work of the particles' stresses on averaged strains.
/// @param stress  of each owned cell [N m]
/// @note Collective
template <class G, int D = G::dim>
void average_stresses(const Mesh<D>& mesh, NodeExchange& exchange, VelocityField<G>& field,
                      std::span<Working<G>> stress);

/// Volumetric strain of a cell after nodal mixed discretisation.
/// @param own  of the cell before
/// @pre average_strains has been called for the field
template <class G, int D = G::dim>
double averaged_strain(const Mesh<D>& mesh, const VelocityField<G>& field, Index cell, double own)
{
  const double mean = mean_of_vertices<D>(mesh, field.integration.groups, cell, field.volumetric_strain);
  const double relaxed = field.integration.relaxing.empty() ? 0 : field.integration.relaxing[cell].strain;
  return own + averaged_strain_fraction(field.integration, cell) * (mean - own) + relaxed;
}

/// Local damping of FLAC for one component, alpha |R| sign(v): its mean over a step through which R acts.
///
/// A node that R slows down, with its force (1 + alpha) |R|, may come to a stop within the step; for the rest of it R
/// speeds it up, with (1 - alpha) |R|. Taking the velocity's sign at the step's start for the whole step would throw a
/// slow node back past its start: its velocity would change sign step by step, and differences of round-off would grow.
/// With the mean, the new velocity rises with the old one at a slope between (1 - alpha) / (1 + alpha) and 1, so that
/// differences never grow by the damping. The implicit scheme has the same law, solved for R
/// (implicit/damped_inertia.h).
/// @tparam T        double, or a vector of components
/// @param momentum  m v at the step's start [N s]
/// @param dt        [s]
template <class T>
inline T local_damping(double alpha, const T& residual, const T& momentum, double dt)
{
  // The force that stops the node at the step's end with its drag; R times the part of the step until the stop lies
  // between zero and R. Selections of values, since branches on the signs of velocities cannot be predicted.
  const T stopping = -1 / ((1 + alpha) * dt) * momentum, none{};
  const T forwards = residual > none ? residual : none, backwards = residual < none ? residual : none;
  const T at_most = stopping < forwards ? stopping : forwards;
  const T slowing = at_most > backwards ? at_most : backwards;
  return alpha * (residual - 2 * slowing);
}
} // namespace mpm::model
