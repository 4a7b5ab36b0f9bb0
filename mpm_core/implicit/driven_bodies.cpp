#include "implicit/driven_bodies.h"

#include "contact/clearance.h"
#include "contact/touch.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
namespace
{
constexpr double difference_length = 1e-7; ///< for derivatives of bodies that rotate, over the radius of a particle

/// The component of a spin or a moment about an axis.
template <int D>
std::size_t about(int axis)
{
  return static_cast<std::size_t>(D == 2 ? 2 : axis - D);
}

/// Force of contact along an axis, or its moment about it, as a force.
template <int D>
double component(const EndTouch<D>& touch, const DrivenAxis<D>& driven)
{
  if (driven.axis < D)
    return touch.force[static_cast<std::size_t>(driven.axis)];
  return cross(in_space<D>(touch.arm), in_space<D>(touch.force))[about<D>(driven.axis)] / driven.length;
}

/// Derivatives of the force of contact f on a particle, and of its components F along and about the axes of its body.
template <int D>
struct PushDerivatives
{
  std::vector<Vector<D>> body_by_particle; ///< dF/du
  std::vector<Vector<D>> particle_by_body; ///< df/dq
  std::vector<double> body_by_body;        ///< dF/dq, row by row
  std::vector<double> body_by_radius;      ///< dF/dr
};

/// Derivatives for a body that does not rotate: its way is as good as one of the particle in the other direction.
template <int D>
PushDerivatives<D> derivatives_along(const EndTouch<D>& touch, std::span<const DrivenAxis<D>> axes)
{
  PushDerivatives<D> by;
  for (const DrivenAxis<D>& driven : axes)
  {
    const auto a = static_cast<std::size_t>(driven.axis);
    Vector<D> row, column;
    for (std::size_t i = 0; i < D; ++i)
    {
      row[i] = -touch.stiffness[a][i];
      column[i] = touch.stiffness[i][a];
    }
    by.body_by_particle.push_back(row);
    by.particle_by_body.push_back(column);
    by.body_by_radius.push_back(touch.by_radius[a]);
    for (const DrivenAxis<D>& other : axes)
      by.body_by_body.push_back(touch.stiffness[a][static_cast<std::size_t>(other.axis)]);
  }
  return by;
}

/// A body that is a little ahead along or about an axis, and one that is behind.
template <int D>
struct Neighbours
{
  RigidBody<D> ahead, behind;
};

template <int D>
using AllNeighbours = std::vector<Neighbours<D>>; // by axis

/// Derivatives for a body that rotates, by differences.
/// @param touch_at  a callable (end of the body, displacement, radius) -> EndTouch<D>
/// @param length    of the differences [m]
template <int D, class TouchAt>
PushDerivatives<D> derivatives_about(const RigidBody<D>& end, const AllNeighbours<D>& ends,
                                     const TouchingParticle<D>& particle, std::span<const DrivenAxis<D>> axes,
                                     double length, TouchAt&& touch_at)
{
  const std::size_t n = axes.size();
  PushDerivatives<D> by{std::vector<Vector<D>>(n), std::vector<Vector<D>>(n), std::vector<double>(n * n),
                        std::vector<double>(n)};
  const Vector<D>& u = particle.displacement;
  const double radius = particle.radius.value;
  const auto slope = [length](double ahead, double behind) { return (ahead - behind) / (2 * length); };
  for (std::size_t i = 0; i < D; ++i)
  {
    Vector<D> more = u, less = u;
    more[i] += length;
    less[i] -= length;
    const EndTouch<D> ahead = touch_at(end, more, radius), behind = touch_at(end, less, radius);
    for (std::size_t a = 0; a < n; ++a)
      by.body_by_particle[a][i] = slope(component<D>(ahead, axes[a]), component<D>(behind, axes[a]));
  }
  for (std::size_t b = 0; b < n; ++b)
  {
    const EndTouch<D> ahead = touch_at(ends[b].ahead, u, radius), behind = touch_at(ends[b].behind, u, radius);
    for (std::size_t i = 0; i < D; ++i)
      by.particle_by_body[b][i] = slope(ahead.force[i], behind.force[i]);
    for (std::size_t a = 0; a < n; ++a)
      by.body_by_body[a * n + b] = slope(component<D>(ahead, axes[a]), component<D>(behind, axes[a]));
  }
  const EndTouch<D> wide = touch_at(end, u, radius + length), narrow = touch_at(end, u, radius - length);
  for (std::size_t a = 0; a < n; ++a)
    by.body_by_radius[a] = slope(component<D>(wide, axes[a]), component<D>(narrow, axes[a]));
  return by;
}

/// Adds what one particle does to the derivatives of the balance of its body.
/// @param first  of the axes of this body
template <class G, int D = G::dim>
void add_particle(const Model<G>& model, const TouchingParticle<D>& at_surface, const PushDerivatives<D>& by, bool nmd,
                  std::size_t first, DrivenBodies<D>& bodies)
{
  const auto cell = static_cast<std::size_t>(at_surface.cell);
  const CellShape<D>& shape = model.mesh.shapes[cell];
  const auto weights = weights_at<D>(shape, at<D>(model.particles.position, at_surface.particle));
  const auto means = means_of(model.mesh, model.fields.front().integration.groups, at_surface.cell);
  const std::size_t n = by.body_by_radius.size();
  for (std::size_t a = 0; a < n; ++a)
  {
    DrivenAxis<D>& driven = bodies.axes[first + a];
    for (std::size_t b = 0; b < n; ++b)
      bodies.block[(first + a) * bodies.axes.size() + first + b] += by.body_by_body[a * n + b];
    const double by_volumetric = by.body_by_radius[a] * at_surface.radius.by_volumetric;
    for (std::size_t k = 0; k <= D; ++k)
    {
      const auto node = static_cast<std::size_t>(model.mesh.cells[cell][k]);
      for (std::size_t i = 0; i < D; ++i)
      {
        driven.column[node][i] -= at_surface.share[k] * by.particle_by_body[a][i];
        driven.row[node][i] += weights[k] * by.body_by_particle[a][i];
      }
      driven.row[node][0] += weights[k] * by.body_by_radius[a] * at_surface.radius.by_motion;
      if (nmd)
        driven.row_by_strain[means[k]] += by_volumetric / (D + 1);
      else
      {
        const Vector<D> dilates = dilation_gradient<G>(shape, static_cast<int>(k));
        for (std::size_t i = 0; i < D; ++i)
          driven.row[node][i] += by_volumetric * dilates[i];
      }
    }
  }
}

/// Angular momentum in space about the centre of a body that rotates freely [N m s].
template <int D>
Vector<3> momentum_of(const RigidBody<D>& body)
{
  return rotated<3>(body.rotation, body.angular_momentum);
}

/// Adds the derivatives of what the particles at a body do, and of its inertia in rotation.
template <class G, int D = G::dim>
void add_rotating(Model<G>& model, std::size_t first, std::size_t last, ImplicitStep<G>& step)
{
  DrivenBodies<D>& bodies = step.bodies;
  const std::span<const DrivenAxis<D>> axes = std::span(bodies.axes).subspan(first, last - first);
  const Contact<D>& contact = model.contacts[axes.front().surface];
  const TrialContact<D>& trial = step.contact.surfaces[axes.front().surface];
  const double length =
      difference_length * (trial.touching.empty() ? axes.back().length : trial.touching.front().radius.value);
  AllNeighbours<D> ends;
  for (std::size_t b = 0; b < axes.size(); ++b)
  {
    const auto moved = [&](double way)
    {
      Motion<D> motion = driven_motion<D>(bodies, axes[b].surface);
      const double more = way / (step.dt * axes[b].length);
      if (axes[b].axis < D)
        motion.velocity[static_cast<std::size_t>(axes[b].axis)] += more;
      else
        motion.spin[about<D>(axes[b].axis)] += more;
      return body_at_end<D>(contact, {step.time, step.dt}, step.options.at_rest, motion);
    };
    ends.push_back({moved(length), moved(-length)});
  }
  const auto* slips = columns_of(model.particles, contact.slip);
  const auto* bonds = columns_of(model.particles, contact.bond);
  for (const TouchingParticle<D>& particle : trial.touching)
  {
    const Index p = particle.particle;
    const Vector<D> x = at<D>(model.particles.position, p);
    Vector<D> old{};
    for (std::size_t i = 0; slips && i < D; ++i)
      old[i] = (*slips)[i][p];
    const double motion = contact.travel + step_travel(contact, trial.end, step.dt) + norm<D>(particle.displacement);
    SeenSurface<D> seen = seen_from(contact, particle.cell, motion);
    const auto touch_at = [&](const RigidBody<D>& end, const Vector<D>& u, double radius)
    {
      EndTouch<D> touch;
      if (bonds)
        return tied_at_end<D>(seen, end, particle.spring, x, u, anchor_of<D>(*bonds, p));
      touches_at_end<D>(seen, end, particle.spring, particle.water, radius, x, u, old, false, touch);
      return touch;
    };
    const auto by = derivatives_about<D>(trial.end, ends, particle, axes, length, touch_at);
    add_particle<G>(model, particle, by, step.options.nmd, first, bodies);
  }
  if (step.options.quasi_static || model.exchange.rank != 0) // the block is summed over all ranks
    return;
  for (std::size_t b = 0; b < axes.size(); ++b)
  {
    const Vector<3> ahead = momentum_of<D>(ends[b].ahead), behind = momentum_of<D>(ends[b].behind);
    for (std::size_t a = 0; a < axes.size(); ++a)
      if (axes[a].axis >= D)
      {
        const std::size_t k = about<D>(axes[a].axis);
        bodies.block[(first + a) * bodies.axes.size() + first + b] +=
            (ahead[k] - behind[k]) / (2 * length * step.dt * axes[a].length);
      }
  }
}

/// The derivatives of all balances; the nodes have the sums of all ranks.
template <class G, int D = G::dim>
void differentiate(Model<G>& model, ImplicitStep<G>& step)
{
  DrivenBodies<D>& bodies = step.bodies;
  const std::size_t nodes = model.mesh.points.size(), n = bodies.axes.size();
  const auto groups = static_cast<std::size_t>(model.fields.front().integration.groups.count);
  bodies.block.assign(n * n, 0.0);
  for (auto& driven : bodies.axes)
  {
    driven.column.assign(nodes, {});
    driven.row.assign(nodes, {});
    driven.row_by_strain.assign(groups * nodes, 0.0);
  }
  for (std::size_t first = 0, last; first < n; first = last)
  {
    const std::size_t surface = bodies.axes[first].surface;
    for (last = first; last < n && bodies.axes[last].surface == surface;)
      ++last;
    if (model.contacts[surface].body.rotates)
    {
      add_rotating(model, first, last, step);
      continue;
    }
    const std::span<const DrivenAxis<D>> axes = std::span(bodies.axes).subspan(first, last - first);
    for (const TouchingParticle<D>& particle : step.contact.surfaces[surface].touching)
      add_particle<G>(model, particle, derivatives_along<D>(particle.touch, axes), step.options.nmd, first, bodies);
  }
  MPI_Allreduce(MPI_IN_PLACE, bodies.block.data(), static_cast<int>(n * n), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  for (std::size_t k = 0; k < n; ++k)
  {
    DrivenAxis<D>& driven = bodies.axes[k];
    if (!step.options.quasi_static && driven.axis < D)
      bodies.block[k * (n + 1)] += driven.mass / (step.dt * step.dt);
    sum_shared(model.exchange, driven.column);
    sum_shared(model.exchange, driven.row);
    sum_shared(model.exchange, driven.row_by_strain.data(), static_cast<int>(groups));
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
    for (int i = D; body.rotates && i < (D == 2 ? 3 : 6); ++i)
    {
      const std::size_t component = about<D>(i);
      DrivenAxis<D> driven{k, i, body.mass, std::sqrt(std::ranges::max(body.inertia) / body.mass)};
      driven.start = step.options.quasi_static ? 0 : driven.length * body.spin[component];
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
      felt[k] -= component<D>(particle.touch, axes[k]);
  MPI_Allreduce(MPI_IN_PLACE, felt.data(), static_cast<int>(felt.size()), MPI_DOUBLE, MPI_SUM, model.exchange.comm);
  const double end = step.time + step.dt;
  const Vector<D> gravity = gravity_at(model, end);
  for (std::size_t k = 0; k < axes.size(); ++k)
  {
    DrivenAxis<D>& driven = axes[k];
    if (driven.axis >= D)
    {
      driven.residual = felt[k];
      if (step.options.quasi_static)
        continue;
      const RigidBody<D>& end = step.contact.surfaces[driven.surface].end;
      const std::size_t i = about<D>(driven.axis);
      const Vector<3> momentum = momentum_of<D>(end);
      const double change = momentum[i] - momentum_of<D>(model.contacts[driven.surface].body)[i];
      driven.inertia = std::max(std::abs(change) / step.dt, norm<3>(cross(end.spin, momentum))) / driven.length;
      driven.residual -= change / (step.dt * driven.length);
      continue;
    }
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
    report.scale = std::max({report.scale, std::abs(driven.applied), driven.inertia});
  }
}

template <int D>
Motion<D> driven_motion(const DrivenBodies<D>& bodies, std::size_t surface)
{
  Motion<D> motion{};
  for (const DrivenAxis<D>& driven : bodies.axes)
    if (driven.surface == surface && driven.axis < D)
      motion.velocity[static_cast<std::size_t>(driven.axis)] = driven.velocity;
    else if (driven.surface == surface)
      motion.spin[about<D>(driven.axis)] = driven.velocity / driven.length;
  return motion;
}

#define INSTANTIATE(G)                                                                                                 \
  template void start_bodies(const Model<G>&, ImplicitStep<G>&);                                                       \
  template void balance_bodies(Model<G>&, bool, ImplicitStep<G>&);                                                     \
  template void add_bodies(const ImplicitStep<G>&, TrialReport&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
template Motion<2> driven_motion<2>(const DrivenBodies<2>&, std::size_t);
template Motion<3> driven_motion<3>(const DrivenBodies<3>&, std::size_t);
} // namespace mpm::implicit
