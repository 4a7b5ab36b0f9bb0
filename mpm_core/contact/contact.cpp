#include "contact/contact.h"

#include "base/tensor.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace mpm::contact
{
template <class G>
double particle_radius(const Particles<G::dim>& particles, Index p)
{
  if constexpr (G::dim == 3)
    return 0.5 * std::cbrt(particles.volume[p]);
  else if constexpr (G::has_hoop)
    return 0.5 * std::sqrt(particles.volume[p] / particles.position[0][p]);
  else
    return 0.5 * std::sqrt(particles.volume[p]);
}

namespace
{
/// Bounds of the gaps in all cells. A particle is no farther from the centre of its cell than the vertices are; as much
/// again is for its radius and for its motion in a step.
template <int D>
void find_clearance(const Mesh<D>& mesh, const Vector<D>& moved, Contact<D>& contact)
{
  contact.clearance.resize(static_cast<std::size_t>(mesh.owned_cells));
  contact.found_at = moved;
  contact.cell_size = std::numeric_limits<double>::infinity();
  for (Index c = 0; c < mesh.owned_cells; ++c)
  {
    const Vector<D>& centre = mesh.shapes[c].centre;
    double squared = 0;
    for (Index node : mesh.cells[c])
    {
      double sum = 0;
      for (int i = 0; i < D; ++i)
        sum += (mesh.points[node][i] - centre[i]) * (mesh.points[node][i] - centre[i]);
      squared = std::max(squared, sum);
    }
    const double reach = std::sqrt(squared);
    Vector<D> x;
    for (int i = 0; i < D; ++i)
      x[i] = centre[i] - moved[i];
    contact.clearance[static_cast<std::size_t>(c)] = distance<D>(contact.surface, x).value - 3 * reach;
    contact.cell_size = std::min(contact.cell_size, reach);
  }
}

/// The part of a vector along a surface.
template <int D>
Vector<D> tangential(Vector<D> v, const Vector<D>& normal)
{
  const double along = dot<D>(v, normal);
  for (int i = 0; i < D; ++i)
    v[i] -= along * normal[i];
  return v;
}

template <int D>
double apart(const Vector<D>& a, const Vector<D>& b)
{
  double sum = 0;
  for (int i = 0; i < D; ++i)
    sum += (a[i] - b[i]) * (a[i] - b[i]);
  return std::sqrt(sum);
}

/// Moment of a force at an arm.
template <int D>
Vector<3> moment_of(const Vector<D>& arm, const Vector<D>& force)
{
  if constexpr (D == 2)
    return {0, 0, arm[0] * force[1] - arm[1] * force[0]};
  else
    return {arm[1] * force[2] - arm[2] * force[1], arm[2] * force[0] - arm[0] * force[2],
            arm[0] * force[1] - arm[1] * force[0]};
}

/// The surface in a step.
template <int D>
struct Moved
{
  Vector<D> by;       ///< its displacement at the step's start [m]
  Vector<D> velocity; ///< in the mean over the step [m/s]
};

template <int D>
Moved<D> moved(const Contact<D>& contact, const TimeStep& step)
{
  Moved<D> now{displacement<D>(contact.motion, contact.start, step.start), {}};
  if (step.dt > 0)
    now.velocity = displacement<D>(contact.motion, step.start, step.start + step.dt);
  for (double& component : now.velocity)
    component /= step.dt > 0 ? step.dt : 1;
  return now;
}

/// Friction: adds a displacement along the surface to the elastic slip and returns it to the cone.
/// @param longest  slip at which the spring's force is that of Coulomb
template <int D>
void update_slip(const Vector<D>& normal, const Vector<D>& increment, double longest, Vector<D>& slip)
{
  for (int i = 0; i < D; ++i)
    slip[i] += increment[i];
  slip = tangential<D>(slip, normal);
  const double length = norm<D>(slip), scale = length > longest ? longest / length : 1;
  for (double& component : slip)
    component *= scale;
}

template <int D>
std::vector<Column>* slip_columns(Particles<D>& particles, const std::string& name)
{
  for (AddedField& field : particles.added)
    if (!name.empty() && field.name == name)
      return &field.columns;
  return nullptr;
}
} // namespace

template <int D>
void begin_step(const Mesh<D>& mesh, const TimeStep& step, Contact<D>& contact)
{
  contact.force = {};
  contact.moment = {};
  // Steps may become shorter and longer. A spring that grew stiffer under load would make energy, so that this one only
  // becomes softer, when the step would be too long for it.
  if (contact.stiff_step == 0)
    contact.stiff_step = step.dt;
  contact.stiff_step = std::max(contact.stiff_step, std::sqrt(contact.penalty) * step.dt);
  const Vector<D> by = displacement<D>(contact.motion, contact.start, step.start);
  if (contact.clearance.empty() || apart<D>(by, contact.found_at) > contact.cell_size)
    find_clearance<D>(mesh, by, contact);
}

namespace
{
/// What all particles need to know in a step.
template <int D>
struct Press
{
  Moved<D> surface;
  double dt;
  double stiffness; ///< per mass [1/s2]
  std::vector<Column>* slips;
};

/// Force on a particle, whose velocity is that of the nodes at its place; takes its slip along. None without contact.
template <class G, int D = G::dim>
std::optional<Vector<D>> particle_force(const Contact<D>& contact, const Press<D>& press, const Vector<D>& velocity,
                                        const Particles<D>& particles, Index p)
{
  Vector<D> x, motion, slip{};
  for (int i = 0; i < D; ++i)
  {
    x[i] = particles.position[i][p] - press.surface.by[i];
    motion[i] = press.dt * (velocity[i] - press.surface.velocity[i]);
  }
  const auto [distance_now, normal] = distance<D>(contact.surface, x);
  const double depth = particle_radius<G>(particles, p) - distance_now - dot<D>(motion, normal);
  const bool touches = depth > 0;
  if (press.slips)
  {
    if (touches)
    {
      for (int i = 0; i < D; ++i)
        slip[i] = (*press.slips)[static_cast<std::size_t>(i)][p];
      update_slip<D>(normal, motion, contact.friction * depth, slip);
    }
    for (int i = 0; i < D; ++i)
      (*press.slips)[static_cast<std::size_t>(i)][p] = slip[i];
  }
  if (!touches)
    return std::nullopt;
  Vector<D> force;
  for (int i = 0; i < D; ++i)
    force[i] = press.stiffness * particles.mass[p] * (depth * normal[i] - slip[i]);
  return force;
}

/// Adds a force at a point to what the surface feels.
template <int D>
void react(const Vector<D>& force, const Vector<D>& x, const Press<D>& press, Contact<D>& contact)
{
  Vector<D> arm;
  for (int i = 0; i < D; ++i)
  {
    arm[i] = x[i] - press.surface.by[i] - contact.reference[i];
    contact.force[i] -= force[i];
    contact.impulse[i] -= press.dt * force[i];
  }
  const Vector<3> moment = moment_of<D>(arm, force);
  for (std::size_t i = 0; i < 3; ++i)
    contact.moment[i] -= moment[i];
}

/// Forces on the particles of a run, by their moments.
/// @returns whether any was in contact
template <class G, int D = G::dim>
bool press_run(const Mesh<D>& mesh, const Run& run, std::span<const Vector<D>> velocity, const Press<D>& press,
               const Particles<D>& particles, Contact<D>& contact, TractionMoments<D>& moments)
{
  const Vector<D>& centre = mesh.shapes[run.cell].centre;
  const auto nodal = [velocity](Index i) -> const Vector<D>& { return velocity[static_cast<std::size_t>(i)]; };
  const AffineField<D> field = affine_field<D>(mesh, run.cell, nodal);
  bool touched = false;
  for (Index p = run.first; p < run.last; ++p)
  {
    const Vector<D> x = at<D>(particles.position, p);
    Vector<D> xi, v;
    for (int i = 0; i < D; ++i)
      xi[i] = x[i] - centre[i];
    for (int i = 0; i < D; ++i)
      v[i] = field.value[i] + dot<D>(field.gradient[i], xi);
    const std::optional<Vector<D>> force = particle_force<G, D>(contact, press, v, particles, p);
    if (!force)
      continue;
    touched = true;
    react<D>(*force, x, press, contact);
    for (int i = 0; i < D; ++i)
    {
      moments.force[i] += (*force)[i];
      for (int j = 0; j < D; ++j)
        moments.force_xi[i][j] += (*force)[i] * xi[j];
    }
  }
  return touched;
}
} // namespace

template <class G, int D>
bool add_contact_forces(const Mesh<D>& mesh, const std::vector<Run>& runs, const Movers& movers,
                        std::span<const Vector<D>> velocity, const TimeStep& step, Particles<D>& particles,
                        Contact<D>& contact, std::span<Vector<D>> forces)
{
  if (contact.stiff_step == 0)
    return false;
  const double stiffness = contact.penalty / (contact.stiff_step * contact.stiff_step);
  const Press<D> press{moved(contact, step), step.dt, stiffness, slip_columns(particles, contact.slip)};
  const double travelled = apart<D>(press.surface.by, contact.found_at) + norm<D>(press.surface.velocity) * step.dt;
  bool touched = false;
  for (const Run& run : runs)
  {
    if (contact.clearance[static_cast<std::size_t>(run.cell)] > travelled ||
        movers.field_of_law[static_cast<std::size_t>(run.material)] != movers.field)
      continue;
    TractionMoments<D> moments{};
    if (!press_run<G, D>(mesh, run, velocity, press, particles, contact, moments))
      continue;
    touched = true;
    for (int k = 0; k <= D; ++k)
      for (int i = 0; i < D; ++i)
        forces[static_cast<std::size_t>(mesh.cells[run.cell][k])][i] +=
            at_vertex<D>(moments.force[i], moments.force_xi[i], mesh.shapes[run.cell].gradient[k]);
  }
  return touched;
}

template <class G, int D>
double smallest_gap(const Particles<D>& particles, const Surface<D>& surface)
{
  double gap = std::numeric_limits<double>::infinity();
  for (Index p = 0; p < particles.size(); ++p)
    gap = std::min(gap, distance<D>(surface, at<D>(particles.position, p)).value - particle_radius<G>(particles, p));
  return gap;
}

template void begin_step<2>(const Mesh<2>&, const TimeStep&, Contact<2>&);
template void begin_step<3>(const Mesh<3>&, const TimeStep&, Contact<3>&);
#define INSTANTIATE(G)                                                                                                 \
  template bool add_contact_forces<G, G::dim>(const Mesh<G::dim>&, const std::vector<Run>&, const Movers&,             \
                                              std::span<const Vector<G::dim>>, const TimeStep&, Particles<G::dim>&,    \
                                              Contact<G::dim>&, std::span<Vector<G::dim>>);                            \
  template double smallest_gap<G, G::dim>(const Particles<G::dim>&, const Surface<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::contact
