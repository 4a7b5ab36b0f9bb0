#include "implicit/driven_bodies.h"

#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
namespace
{
/// Adds what one particle does to the derivatives of the balance of its body.
/// @param first  of the axes of this body
template <class G, int D = G::dim>
void add_particle(const Model<G>& model, Index cell, const TouchingParticle<D>& at_surface, bool nmd, std::size_t first,
                  std::size_t last, DrivenBodies<D>& bodies)
{
  const CellShape<D>& shape = model.mesh.shapes[static_cast<std::size_t>(cell)];
  const EndTouch<D>& touch = at_surface.touch;
  const auto weights = weights_at<D>(shape, at<D>(model.particles.position, at_surface.particle));
  for (std::size_t n = first; n < last; ++n)
  {
    DrivenAxis<D>& driven = bodies.axes[n];
    const auto a = static_cast<std::size_t>(driven.axis);
    for (std::size_t m = first; m < last; ++m)
      bodies.block[n * bodies.axes.size() + m] += touch.stiffness[a][static_cast<std::size_t>(bodies.axes[m].axis)];
    const double by_volumetric = touch.by_radius[a] * at_surface.radius.by_volumetric;
    for (std::size_t k = 0; k <= D; ++k)
    {
      const auto node = static_cast<std::size_t>(model.mesh.cells[static_cast<std::size_t>(cell)][k]);
      for (std::size_t i = 0; i < D; ++i)
      {
        driven.column[node][i] -= weights[k] * touch.stiffness[i][a];
        driven.row[node][i] -= weights[k] * touch.stiffness[a][i];
      }
      driven.row[node][0] += weights[k] * touch.by_radius[a] * at_surface.radius.by_motion;
      if (nmd)
        driven.row_by_strain[node] += by_volumetric / (D + 1);
      else
      {
        const Vector<D> dilates = dilation_gradient<G>(shape, static_cast<int>(k));
        for (std::size_t i = 0; i < D; ++i)
          driven.row[node][i] += by_volumetric * dilates[i];
      }
    }
  }
}

/// The derivatives of all balances; the nodes have the sums of all ranks.
template <class G, int D = G::dim>
void differentiate(Model<G>& model, ImplicitStep<G>& step)
{
  DrivenBodies<D>& bodies = step.bodies;
  const std::size_t nodes = model.mesh.points.size(), n = bodies.axes.size();
  bodies.block.assign(n * n, 0.0);
  for (auto& driven : bodies.axes)
  {
    driven.column.assign(nodes, {});
    driven.row.assign(nodes, {});
    driven.row_by_strain.assign(nodes, 0.0);
  }
  for (std::size_t first = 0, last; first < n; first = last)
  {
    const std::size_t surface = bodies.axes[first].surface;
    for (last = first; last < n && bodies.axes[last].surface == surface;)
      ++last;
    for (const TouchingParticle<D>& particle : step.contact.surfaces[surface].touching)
      add_particle<G>(model, particle.cell, particle, step.options.nmd, first, last, bodies);
  }
  MPI_Allreduce(MPI_IN_PLACE, bodies.block.data(), static_cast<int>(n * n), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  for (std::size_t k = 0; k < n; ++k)
  {
    DrivenAxis<D>& driven = bodies.axes[k];
    if (!step.options.quasi_static)
      bodies.block[k * (n + 1)] += driven.mass / (step.dt * step.dt);
    sum_shared(model.exchange, driven.column);
    sum_shared(model.exchange, driven.row);
    sum_shared(model.exchange, driven.row_by_strain.data(), 1);
  }
}
} // namespace

template <class G>
void start_bodies(const Model<G>& model, ImplicitStep<G>& step)
{
  constexpr int D = G::dim;
  auto& axes = step.bodies.axes;
  axes.clear();
  for (std::size_t k = 0; k < model.contacts.size(); ++k)
  {
    const RigidBody<D>& body = model.contacts[k].body;
    for (int i = 0; i < D; ++i)
    {
      const Drive drive = body.drive[static_cast<std::size_t>(i)];
      if (drive == Drive::prescribed)
        continue;
      DrivenAxis<D> driven{k, i, drive == Drive::free ? body.mass : 0};
      driven.start = step.options.quasi_static ? 0 : body.velocity[static_cast<std::size_t>(i)];
      driven.velocity = driven.start;
      axes.push_back(driven);
    }
  }
}

template <class G>
void balance_bodies(Model<G>& model, bool tangents, ImplicitStep<G>& step)
{
  constexpr int D = G::dim;
  auto& axes = step.bodies.axes;
  if (axes.empty())
    return;
  std::vector<double> felt(axes.size(), 0.0);
  for (std::size_t k = 0; k < axes.size(); ++k)
    for (const TouchingParticle<D>& particle : step.contact.surfaces[axes[k].surface].touching)
      felt[k] -= particle.touch.force[static_cast<std::size_t>(axes[k].axis)];
  MPI_Allreduce(MPI_IN_PLACE, felt.data(), static_cast<int>(felt.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  const double end = step.time + step.dt;
  const Vector<D> gravity = gravity_at(model, end);
  for (std::size_t k = 0; k < axes.size(); ++k)
  {
    DrivenAxis<D>& driven = axes[k];
    const auto i = static_cast<std::size_t>(driven.axis);
    driven.applied = value_at(model.contacts[driven.surface].body.force, end)[i] + driven.mass * gravity[i];
    driven.residual = driven.applied + felt[k];
    if (!step.options.quasi_static)
      driven.residual -= driven.mass * (driven.velocity - driven.start) / step.dt;
  }
  if (tangents)
    differentiate(model, step);
}

template <class G>
void add_bodies(const ImplicitStep<G>& step, TrialReport& report)
{
  for (const auto& driven : step.bodies.axes)
  {
    report.residual = std::hypot(report.residual, driven.residual);
    report.scale = std::max(report.scale, std::abs(driven.applied));
  }
}

template <int D>
Vector<D> driven_velocity(const DrivenBodies<D>& bodies, std::size_t surface)
{
  Vector<D> velocity{};
  for (const DrivenAxis<D>& driven : bodies.axes)
    if (driven.surface == surface)
      velocity[static_cast<std::size_t>(driven.axis)] = driven.velocity;
  return velocity;
}

#define INSTANTIATE(G)                                                                                                 \
  template void start_bodies(const Model<G>&, ImplicitStep<G>&);                                                       \
  template void balance_bodies(Model<G>&, bool, ImplicitStep<G>&);                                                     \
  template void add_bodies(const ImplicitStep<G>&, TrialReport&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
template Vector<2> driven_velocity<2>(const DrivenBodies<2>&, std::size_t);
template Vector<3> driven_velocity<3>(const DrivenBodies<3>&, std::size_t);
} // namespace mpm::implicit
