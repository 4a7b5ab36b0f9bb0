#include "implicit/pore_drying.h"

#include "implicit/pore_water.h"
#include "model/anisotropy.h"
#include "model/integration.h"

namespace mpm::implicit
{
namespace
{
/// Water of a particle, and what it gains over the step.
struct DryingParticle
{
  double volume, porosity, storage; ///< V, n, n / K_w
  double growth;                    ///< volumetric strain
  double start, end;                ///< pressures [Pa]
  double standing;                  ///< pressure of water that stands above it [Pa]
};

template <int D>
void add_particle(const DryingParticle& particle, const Matrix<D>& mobility, const Retention& retention,
                  const std::array<double, D + 1>& n, DryingCell<D>& cell)
{
  const Wetness before = wetness_at(retention, particle.start), after = wetness_at(retention, particle.end);
  const double volume = particle.volume;
  const double gained = particle.growth + particle.storage * (particle.end - particle.start);
  const double content = after.saturation * gained + (after.saturation - before.saturation) * particle.porosity;
  const double capacity = after.saturation * particle.storage + after.by_saturation * (gained + particle.porosity);
  cell.pressure += volume * (after.effective * particle.end - particle.standing);
  add<D>(volume * after.permeability, mobility, cell.flux);
  for (int k = 0; k <= D; ++k)
  {
    const double weight = volume * n[k];
    cell.by_pressure[k] += weight * (after.effective + after.by_effective * particle.end);
    cell.content[k] += weight * content;
    cell.wet[k] += weight * after.saturation;
    add<D>(weight * after.by_permeability, mobility, cell.flux_by_pressure[k]);
    for (int l = 0; l <= D; ++l)
      cell.capacity[k][l] += weight * n[l] * capacity;
  }
}
} // namespace

template <class G, int D>
void try_drying(const Mesh<D>& mesh, const Particles<D>& particles, const std::vector<Run>& runs,
                const VelocityField<G>& field, const PoreWater& water, ImplicitStep<G>& step)
{
  PoreStep<D>& pore = step.pore;
  pore.drying.assign(pore.cells.size(), DryingCell<D>{});
  for (const Run& run : runs)
  {
    const double factor = integration_factor(mesh, field, run.cell);
    const auto standing = standing_water(mesh, water, run.cell);
    const double growth = growth_of(mesh, field, step, run.cell);
    const Matrix<D> anisotropy = anisotropy_of<D>(water, run.material).tensor;
    for (Index p = run.first; p < run.last; ++p)
    {
      const Vector<D> x = at<D>(particles.position, p);
      const auto n = shape_functions<D>(mesh.shapes[run.cell], x);
      double end = particles.pore_pressure[0][p];
      for (int k = 0; k <= D && pore.flows; ++k)
        end += step.dt * pore.rate[mesh.cells[run.cell][k]] * n[k];
      const DryingParticle particle{factor * particles.volume[p],
                                    particles.porosity[0][p],
                                    particles.porosity[0][p] / water.modulus,
                                    growth,
                                    particles.pore_pressure[0][p],
                                    end,
                                    pressure_at<D>(standing, n)};
      Matrix<D> mobility{};
      add<D>(step.dt * particles.conductivity[0][p] / laboratory_weight(water), anisotropy, mobility);
      add_particle<D>(particle, mobility, water.retention[static_cast<std::size_t>(run.material)], n,
                      pore.drying[static_cast<std::size_t>(run.cell)]);
    }
  }
}

#define INSTANTIATE(G)                                                                                                 \
  template void try_drying(const Mesh<G::dim>&, const Particles<G::dim>&, const std::vector<Run>&,                     \
                           const VelocityField<G>&, const PoreWater&, ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
