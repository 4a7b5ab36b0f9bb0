#include "explicit/phase_momentum.h"

#include "explicit/directed_drag.h"
#include "model/mapping.h"

#include <algorithm>

namespace mpm::explicit_scheme
{
namespace
{
/// Forces on the phases of a node but for drag and damping, and what moves.
template <int D>
struct PhaseForces
{
  double soil_mass, water_mass, drag;
  Vector<D> on_soil, on_water;
  Vector<D> external_on_soil, external_on_water;
};

template <class G, int D = G::dim>
PhaseForces<D> phase_forces(const VelocityField<G>& soil, const WaterField<G>& water, Index i,
                            const Vector<G::dim>& gravity, double density)
{
  const NodeSums<D>& s = soil.nodes[i];
  const NodeSums<D>& w = water.motion.nodes[i];
  const Vector<D> damping = water.motion.damping_force.empty() ? Vector<D>{} : water.motion.damping_force[i];
  PhaseForces<D> f{s.mass, is_light(water.motion, i) ? 0 : w.mass, water.nodes[i].drag, {}, {}, {}, {}};
  const double porosity =
      f.water_mass == 0 ? 0 : std::min(1.0, f.water_mass / (density * water.nodes[i].volume)); // filled part of it
  for (int a = 0; a < D; ++a)
  {
    const double of_water = porosity * w.traction[a] + damping[a]; // of the traction, which acts on both
    f.external_on_water[a] = f.water_mass * gravity[a] + of_water;
    f.external_on_soil[a] = f.soil_mass * gravity[a] + s.traction[a] - of_water;
    f.on_water[a] = f.external_on_water[a] - porosity * w.internal[a];
    f.on_soil[a] = f.external_on_soil[a] - s.internal[a] - (1 - porosity) * w.internal[a];
  }
  return f;
}

/// Local damping of the node as a whole, by mass; none where the soil is held, whose reaction is no residual.
template <int D>
Phases<D> damping_forces(const PhaseForces<D>& f, const Support<D>* support, const Phases<D>& start, double damping,
                         double dt)
{
  Vector<D> force;
  for (int a = 0; a < D; ++a)
    force[a] = local_damping(damping, f.on_soil[a] + f.on_water[a],
                             f.soil_mass * start.soil[a] + f.water_mass * start.water[a], dt);
  if (support)
    take_out_supported<D>(*support, force);
  Phases<D> forces;
  const double soil_part = f.soil_mass / (f.soil_mass + f.water_mass);
  for (int a = 0; a < D; ++a)
  {
    forces.soil[a] = force[a] * soil_part;
    forces.water[a] = force[a] * (1 - soil_part);
  }
  return forces;
}

/// Velocities at the end where nothing is prescribed: the mean, and the difference after drag.
template <int D>
Phases<D> free_velocities(const PhaseForces<D>& f, const Phases<D>& damped, const Phases<D>& start, double dt)
{
  Phases<D> end;
  const double ms = f.soil_mass, mw = f.water_mass, mass = ms + mw;
  for (int a = 0; a < D; ++a)
  {
    const double soil = start.soil[a] + dt * (f.on_soil[a] - damped.soil[a]) / ms;
    const double water = mw == 0 ? soil : start.water[a] + dt * (f.on_water[a] - damped.water[a]) / mw;
    const double relative = mw == 0 ? 0 : (water - soil) / (1 + dt * f.drag * (1 / ms + 1 / mw));
    const double mean = (ms * soil + mw * water) / mass;
    end.soil[a] = mean - mw / mass * relative;
    end.water[a] = mean + ms / mass * relative;
  }
  return end;
}

/// Velocities at the end where the drag depends on the direction, with the soil's support.
template <int D>
Phases<D> directed_velocities(const PhaseForces<D>& f, const Matrix<D>& drag, const Phases<D>& damped,
                              const Phases<D>& start, const Support<D>* support, double dt)
{
  Phases<D> momenta;
  Matrix<D> by_drag{};
  add<D>(dt, drag, by_drag);
  for (int a = 0; a < D; ++a)
  {
    momenta.soil[a] = f.soil_mass * start.soil[a] + dt * (f.on_soil[a] - damped.soil[a]);
    momenta.water[a] = f.water_mass * start.water[a] + dt * (f.on_water[a] - damped.water[a]);
  }
  return velocities_after_drag<D>(f.soil_mass, f.water_mass, momenta, by_drag, support);
}

/// Prescribed velocities of the soil; the water beside it has the drag of that soil.
template <int D>
void hold_soil(const Support<D>& support, const PhaseForces<D>& f, const Phases<D>& damped, const Phases<D>& start,
               double dt, Phases<D>& end)
{
  for (int k = 0; k < support.count && f.water_mass > 0; ++k)
  {
    const Vector<D>& n = support.direction[k];
    const double force = dot<D>(n, f.on_water) - dot<D>(n, damped.water), by_drag = dt * f.drag / f.water_mass;
    const double along =
        (dot<D>(n, start.water) + dt * force / f.water_mass + by_drag * support.value[k]) / (1 + by_drag);
    const double change = along - dot<D>(n, end.water);
    for (int a = 0; a < D; ++a)
      end.water[a] += change * n[a];
  }
  impose<D>(support, end.soil);
}

/// The entry of each node in turn, of entries sorted by node.
template <class T>
class EntryOf
{
public:
  explicit EntryOf(const std::vector<T>& entries) : _next(entries.begin()), _end(entries.end()) {}
  /// @param node  not below that of the last call
  const T* operator()(Index node)
  {
    while (_next != _end && _next->node < node)
      ++_next;
    return _next != _end && _next->node == node ? &*_next : nullptr;
  }

private:
  typename std::vector<T>::const_iterator _next, _end;
};

/// Gives soil and water one velocity along impervious directions: that of their momentum, or that of the soil.
template <int D>
void close(const ImperviousNode<D>& side, double soil_part, Phases<D>& v)
{
  for (int k = 0; k < side.count; ++k)
  {
    const Vector<D>& n = side.direction[k];
    const double relative = dot<D>(n, v.water) - dot<D>(n, v.soil);
    for (int a = 0; a < D; ++a)
    {
      v.soil[a] += (1 - soil_part) * relative * n[a];
      v.water[a] -= soil_part * relative * n[a];
    }
  }
}
} // namespace

template <class G>
void find_phase_accelerations(const Vector<G::dim>& gravity, double damping, double dt, double density,
                              VelocityField<G>& soil, WaterField<G>& water)
{
  constexpr int D = G::dim;
  EntryOf support_of(soil.supports);
  EntryOf side_of(water.closed);
  for (Index i : soil.part.nodes)
  {
    if (is_light(soil, i))
    {
      soil.acceleration[i] = water.motion.acceleration[i] = {};
      continue;
    }
    const PhaseForces<D> f = phase_forces<G>(soil, water, i, gravity, density);
    const Phases<D> start{soil.start_velocity[i], water.motion.start_velocity[i]};
    const Support<D>* support = support_of(i);
    const Phases<D> damped = damping_forces<D>(f, support, start, damping, dt);
    const bool directed = !water.drag.empty() && f.water_mass > 0;
    Phases<D> end = directed ? directed_velocities<D>(f, water.drag[i], damped, start, support, dt)
                             : free_velocities<D>(f, damped, start, dt);
    const ImperviousNode<D>* side = side_of(i);
    if (side)
      close<D>(*side, f.soil_mass / (f.soil_mass + f.water_mass), end);
    if (support && directed)
      impose<D>(*support, end.soil); // once more, as sides may have changed it
    else if (support)
      hold_soil<D>(*support, f, damped, start, dt, end);
    if (side)
      close<D>(*side, 1, end);
    for (int a = 0; a < D; ++a)
    {
      soil.acceleration[i][a] = (end.soil[a] - start.soil[a]) / dt;
      water.motion.acceleration[i][a] = (end.water[a] - start.water[a]) / dt;
    }
  }
}

template <class G>
void follow_supports(const VelocityField<G>& soil, const VelocityField<G>& water,
                     std::span<Vector<G::dim>> water_velocity)
{
  for (std::size_t s = 0; s < soil.supports.size(); ++s)
  {
    const Index i = soil.supports[s].node;
    if (soil.part.has_node[i] && !is_light(soil, i) && !is_light(water, i))
      for (int a = 0; a < G::dim; ++a)
        water_velocity[i][a] += soil.imposed[s][a];
  }
}

template <class G>
void close_sides(const VelocityField<G>& soil, const WaterField<G>& water, std::span<Vector<G::dim>> soil_velocity,
                 std::span<Vector<G::dim>> water_velocity)
{
  constexpr int D = G::dim;
  EntryOf support_of(soil.supports);
  for (const ImperviousNode<D>& side : water.closed)
  {
    const Index i = side.node;
    if (!soil.part.has_node[i] || is_light(soil, i))
      continue;
    Phases<D> v{soil_velocity[i], water_velocity[i]};
    close<D>(side, soil.nodes[i].mass / (soil.nodes[i].mass + water.motion.nodes[i].mass), v);
    if (const Support<D>* support = support_of(i))
      impose<D>(*support, v.soil);
    close<D>(side, 1, v);
    soil_velocity[i] = v.soil;
    water_velocity[i] = v.water;
  }
}

template <class G>
void add_phase_work(const VelocityField<G>& soil, const WaterField<G>& water, std::span<const unsigned char> owned,
                    const Vector<G::dim>& gravity, double damping, double dt, double density, Totals& totals)
{
  constexpr int D = G::dim;
  EntryOf support_of(soil.supports);
  for (Index i : soil.part.nodes)
  {
    if (!owned[i] || is_light(soil, i))
      continue;
    const PhaseForces<D> f = phase_forces<G>(soil, water, i, gravity, density);
    const Phases<D> start{soil.start_velocity[i], water.motion.start_velocity[i]};
    const Phases<D> damped = damping_forces<D>(f, support_of(i), start, damping, dt);
    Vector<D> relative, drag; // at the end
    for (int a = 0; a < D; ++a)
    {
      relative[a] = start.water[a] - start.soil[a] + dt * (water.motion.acceleration[i][a] - soil.acceleration[i][a]);
      drag[a] = f.drag * relative[a];
    }
    if (!water.drag.empty())
      drag = product<D>(water.drag[i], relative);
    for (int a = 0; a < D; ++a)
    {
      const double us = 0.5 * dt * (start.soil[a] + soil.velocity[i][a]);
      const double uw = 0.5 * dt * (start.water[a] + water.motion.velocity[i][a]);
      const double force_s = f.soil_mass * soil.acceleration[i][a],
                   force_w = f.water_mass * water.motion.acceleration[i][a];
      totals.external_work += f.external_on_soil[a] * us + f.external_on_water[a] * uw;
      totals.internal_work +=
          (f.external_on_soil[a] - f.on_soil[a]) * us + (f.external_on_water[a] - f.on_water[a]) * uw;
      totals.damping_work += damped.soil[a] * us + damped.water[a] * uw;
      totals.drag_work += drag[a] * (uw - us);
      totals.support_work += (force_s - f.on_soil[a] + damped.soil[a] - drag[a]) * us +
                             (force_w - f.on_water[a] + damped.water[a] + drag[a]) * uw;
    }
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void find_phase_accelerations(const Vector<G::dim>&, double, double, double, VelocityField<G>&,             \
                                         WaterField<G>&);                                                              \
  template void follow_supports(const VelocityField<G>&, const VelocityField<G>&, std::span<Vector<G::dim>>);          \
  template void close_sides(const VelocityField<G>&, const WaterField<G>&, std::span<Vector<G::dim>>,                  \
                            std::span<Vector<G::dim>>);                                                                \
  template void add_phase_work(const VelocityField<G>&, const WaterField<G>&, std::span<const unsigned char>,          \
                               const Vector<G::dim>&, double, double, double, Totals&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::explicit_scheme
