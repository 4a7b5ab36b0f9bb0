#include "model/water_pass.h"

#include "base/lanes.h"
#include "model/mapping.h"
#include "model/pic_loss.h"
#include "model/water_mapping.h"
#include "transfer/affine_field.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mpm::model
{
namespace
{
/// What the nodes do to the water of a cell over a step.
template <int D>
struct WaterChange
{
  double growth;           ///< volumetric strain of the soil
  double outflow;          ///< mass that leaves a unit of volume [kg/m3]
  double spread;           ///< fraction of what particles differ by that spreads evenly over the pores
  double content;          ///< mass in a unit of volume of the pores at the start [kg/m3]
  Vector<D> exchange;      ///< change of its velocity as it spreads
  AffineField<D> velocity; ///< by which that of the water changes
};

/// How much of a difference of pressures between the particles of a cell flows off over dt, as a wave of the length 2 h
/// between impervious sides does: the rate is pi^2 c / h^2, c = k K_w / (n gamma_w).
template <class G, int D = G::dim>
double spread_fraction(const WaterField<G>& water, const CellShape<D>& shape, Index cell, double modulus, double dt)
{
  const PoreMoments<D>& pores = water.cells[cell];
  const double h = smallest_altitude<D>(shape), pi = std::numbers::pi;
  return -std::expm1(-dt * pi * pi * modulus * pores.pores / (pores.drag * h * h));
}

/// Mass that leaves a unit of volume of a cell [kg/m3].
template <class G>
double outflow_of_cell(const Mesh<G::dim>& mesh, const WaterField<G>& water, Index cell, double dt, bool nmd)
{
  return nmd ? averaged_outflow(mesh, water, cell, dt) : outflow(mesh, water, cell, dt);
}

template <class G, int D = G::dim>
WaterChange<D> water_change(const Mesh<D>& mesh, const VelocityField<G>& soil, const WaterField<G>& water, Index cell,
                            double modulus, double dt, bool nmd)
{
  const auto change = [&](Index i) -> const Vector<D>& { return water.motion.velocity_change[i]; };
  double divergence = 0;
  for (int k = 0; k <= D; ++k)
    divergence +=
        dot<D>(value_of_vertex(mesh, soil, soil.velocity, cell, k), dilation_gradient<G>(mesh.shapes[cell], k));
  const CellMoments<G>& moments = water.motion.moments[cell];
  const PoreMoments<D>& pores = water.cells[cell];
  const double content = moments.mass / pores.pores;
  const double spread = spread_fraction(water, mesh.shapes[cell], cell, modulus, dt);
  Vector<D> exchange;
  for (int a = 0; a < D; ++a)
    exchange[a] = spread * (moments.momentum[a] - content * pores.pore_velocity[a]) / moments.mass;
  return {nmd ? averaged_strain(mesh, soil, cell, dt * divergence) : dt * divergence,
          outflow_of_cell(mesh, water, cell, dt, nmd),
          spread,
          content,
          exchange,
          affine_field<D>(mesh, cell, change)};
}

/// sum V p
template <int D>
double pressure_sum(const Particles<D>& particles, const Run& run)
{
  Lanes sum{};
  add_lanes(std::array<const double*, 2>{particles.volume.data(), particles.pore_pressure[0].data()}, run.first,
            run.last,
            [&sum](const Piece<2>& piece, const LaneMask& mine) { sum += mine ? piece[0] * piece[1] : Lanes{}; });
  return base::sum(sum);
}

/// sum V w^2
template <int D>
double squared_velocity_sum(const Particles<D>& particles, const Run& run)
{
  std::array<const double*, D + 1> columns{particles.volume.data()};
  for (int a = 0; a < D; ++a)
    columns[a + 1] = particles.water_velocity[a].data();
  Lanes sum{};
  add_lanes(columns, run.first, run.last,
            [&sum](const Piece<D + 1>& piece, const LaneMask& mine)
            {
              Lanes squared{};
              for (int a = 0; a < D; ++a)
                squared += piece[a + 1] * piece[a + 1];
              sum += mine ? piece[0] * squared : Lanes{};
            });
  return base::sum(sum);
}

/// @returns whether all pores are open
template <int D>
bool change_water(Particles<D>& particles, const PoreWater& water, const Run& run, const Vector<D>& centre,
                  double flip_fraction, const WaterChange<D>& change)
{
  std::array<double*, 2 * D + 5> columns;
  for (int i = 0; i < D; ++i)
  {
    columns[i] = particles.position[i].data();
    columns[D + i] = particles.water_velocity[i].data();
  }
  constexpr int mass_at = 2 * D, volume_at = mass_at + 1, pressure_at = mass_at + 2, porosity_at = mass_at + 3,
                conductivity_at = mass_at + 4;
  columns[mass_at] = particles.water_mass[0].data();
  columns[volume_at] = particles.volume.data();
  columns[pressure_at] = particles.pore_pressure[0].data();
  columns[porosity_at] = particles.porosity[0].data();
  columns[conductivity_at] = particles.conductivity[0].data();
  const double density = water.density, modulus = water.modulus, least = -water.suction_limit;
  const bool follows = water.kozeny_carman;
  LaneMask closed{};
  change_lanes<false>(columns, run.first, run.last,
                      [&, c = change, x0 = centre](Piece<2 * D + 5>& piece)
                      {
                        const Lanes volume = piece[volume_at], before = piece[porosity_at];
                        const Lanes pores = volume * (before + c.growth), porosity = pores / (volume * (1 + c.growth));
                        piece[mass_at] +=
                            c.spread * (volume * c.content * before - piece[mass_at]) - volume * c.outflow;
                        const Lanes pressure = modulus * (piece[mass_at] / (density * pores) - 1);
                        piece[pressure_at] = pressure > least ? pressure : Lanes{} + least;
                        piece[porosity_at] = porosity;
                        closed |= ~(pores > 0);
                        if (follows)
                        {
                          const Lanes ratio = porosity / before, grains = (1 - before) / (1 - porosity);
                          piece[conductivity_at] *= ratio * ratio * ratio * grains * grains;
                        }
                        for (int a = 0; a < D; ++a)
                        {
                          Lanes w = flip_fraction * (piece[D + a] + c.exchange[a]) + c.velocity.value[a];
                          for (int b = 0; b < D; ++b)
                            w += c.velocity.gradient[a][b] * (piece[b] - x0[b]);
                          piece[D + a] = w;
                        }
                      });
  std::int64_t any = 0;
  for (int l = 0; l < lanes; ++l)
    any |= closed[l];
  return any == 0;
}

/// The water of a resting cell moves as that of its particles would, at whose places its velocity is affine.
template <int D>
void change_gradient(Particles<D>& particles, Index row, double flip_fraction, const WaterChange<D>& change)
{
  for (int k = 0; k < D * D; ++k)
  {
    double& gradient = particles.water_gradient[k][row];
    gradient = flip_fraction * gradient + change.velocity.gradient[k / D][k % D];
  }
}

template <class G>
void note_closed_pores(Model<G>& model, const Run& run)
{
  constexpr int D = G::dim;
  for (Index p = run.first; p < run.last; ++p)
    if (!(model.particles.porosity[0][p] > 0))
      return note_failure<D>(model.failure, model.particles, Failure<D>::Kind::closed_pores, p, {});
}
} // namespace

template <class G>
std::array<double, 2> water_pass(Model<G>& model, double dt, double flip_fraction, bool nmd)
{
  constexpr int D = G::dim;
  Particles<D>& particles = model.particles;
  const double density = model.water->density;
  std::array<double, 2> work{};
  const auto change_run = [&](const Run& run)
  {
    const auto change =
        water_change(model.mesh, model.fields.front(), model.water_field, run.cell, model.water->modulus, dt, nmd);
    const double half_strain = 0.5 * (change.growth + change.outflow / density);
    work[0] -= half_strain * pressure_sum(particles, run);
    if (run.resting)
      change_gradient<D>(particles, run.first, flip_fraction, change);
    else if (flip_fraction < 1)
      model.energy.pic_loss += pic_loss(
          model.mesh, particles, model.water_field.motion, run, 1 - flip_fraction, particles.water_mass[0].data(),
          [&](Index p, int a) { return particles.water_velocity[a][p] + change.exchange[a]; });
    if (!change_water<D>(particles, *model.water, run, model.mesh.shapes[run.cell].centre, flip_fraction, change))
      note_closed_pores(model, run);
    model.energy.outflow_kinetic += 0.5 * change.outflow * squared_velocity_sum(particles, run);
    work[1] -= half_strain * (1 + change.growth) * pressure_sum(particles, run); // volumes grow later in the step
  };
  std::ranges::for_each(model.order.runs, change_run);
  std::ranges::for_each(model.fields.front().resting.runs, change_run);
  for (Index c : model.water_field.motion.part.cells)
    if (model.water_field.motion.moments[c].volume > 0)
      model.water->inflow -= model.water_field.motion.moments[c].volume *
                             outflow_of_cell(model.mesh, model.water_field, c, dt, nmd) / density;
  return work;
}

#define INSTANTIATE(G) template std::array<double, 2> water_pass(Model<G>&, double, double, bool);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
