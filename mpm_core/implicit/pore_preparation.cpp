#include "implicit/pore_preparation.h"

#include "contact/clearance.h"
#include "implicit/pore_surface.h"
#include "implicit/pore_water.h"
#include "model/anisotropy.h"
#include "model/integration.h"
#include "model/material_points.h"
#include "transfer/resting.h"

#include <algorithm>
#include <cmath>

namespace mpm::implicit
{
namespace
{
/// Factor of the pressure projection over the least factor that suffices in uniaxial strain, in cells that are not
/// flat.
constexpr double projection_margin = 4;

/// Modulus with which soil resists a compression, that with which it resists displacements that alternate from node to
/// node, and what its mass adds to the latter over its density.
struct Resistance
{
  double compressed, alternating, per_density;
};

/// Sums over the particles of a run of the properties of their water, V times ...
template <int D>
struct PoreSums
{
  double volume = 0;     ///< 1
  Matrix<D> mobility{};  ///< k / gamma_w
  double least = 0;      ///< likewise, of the direction in which that is least
  double compliance = 0; ///< 1 / M + n / K_w + n dS/dp, the compliance of the soil without drainage
  double swung = 0;      ///< likewise, of soil whose mass resists too: what the pressure projection goes by
};

double longest_edge_squared(const auto& points, const auto& cell)
{
  double longest = 0;
  for (std::size_t k = 0; k < cell.size(); ++k)
    for (std::size_t l = 0; l < k; ++l)
    {
      double squared = 0;
      for (std::size_t a = 0; a < points[cell[k]].size(); ++a)
        squared += std::pow(points[cell[k]][a] - points[cell[l]][a], 2);
      longest = std::max(longest, squared);
    }
  return longest;
}

/// Shape functions N_k at a particle and their products N_k N_l; of a resting cell, their means over the particles that
/// it stands for.
template <int D>
struct MeanShapes
{
  std::array<double, D + 1> n;
  std::array<std::array<double, D + 1>, D + 1> products;
};

template <class G, int D = G::dim>
MeanShapes<D> mean_shapes(const CellShape<D>& shape, const CellMoments<G>& moments, const Particles<D>& particles,
                          Index p)
{
  MeanShapes<D> means;
  means.n = shape_functions<D>(shape, at<D>(particles.position, p));
  const bool rests = is_resting(particles, p);
  const auto function = [&](int k) { return AffineScalar<D>{1.0 / (D + 1), shape.gradient[k]}; };
  for (int k = 0; k <= D; ++k)
    for (int l = 0; l <= D; ++l)
      means.products[k][l] =
          rests ? sum_of_products<G>(function(k), function(l), moments) / moments.mass : means.n[k] * means.n[l];
  for (int k = 0; rests && k <= D; ++k)
    means.n[k] = at_vertex<D>(moments.mass, moments.mass_xi, shape.gradient[k]) / moments.mass;
  return means;
}

/// Adds a particle to the sums of its cell and, by affine extrapolation of its pressure, of the cell's nodes.
template <class G, int D = G::dim>
void add_particle(const Mesh<D>& mesh, const Particles<D>& particles, const PoreWater& water, const Run& run, Index p,
                  const Resistance& soil, double factor, const StandingWater<D>& standing,
                  const Anisotropy<D>& anisotropy, const CellMoments<G>& moments, PoreCell<D>& cell, PoreSums<D>& sums,
                  std::vector<NodalWater>& nodes)
{
  const bool dries = water.may_dry(); // then what is stored depends on the iterate
  const Vector<D> x = at<D>(particles.position, p);
  const auto [n, products] = mean_shapes(mesh.shapes[run.cell], moments, particles, p);
  const double volume = factor * particles.volume[p], pressure = particles.pore_pressure[0][p];
  const double storage = particles.porosity[0][p] / water.modulus;
  const double mobility = particles.conductivity[0][p] / laboratory_weight(water);
  double stored = storage;
  if (dries)
    stored += particles.porosity[0][p] *
              wetness_at(water.retention[static_cast<std::size_t>(run.material)], pressure).by_saturation;
  const double compliance = 1 / soil.compressed + stored;
  cell.grains = std::max(cell.grains, 1 - particles.porosity[0][p]);
  add_pore_load(mesh.shapes[run.cell], particles, water, standing, moments, run.material, p, volume, cell.load);
  sums.volume += volume;
  add<D>(volume * mobility, anisotropy.tensor, sums.mobility);
  sums.least += volume * mobility * anisotropy.least;
  sums.compliance += volume * compliance;
  const double resists = soil.alternating + soil.per_density * particles.mass[p] / particles.volume[p];
  sums.swung += volume * (1 / resists + stored);
  for (int k = 0; k <= D; ++k)
  {
    const Index node = mesh.cells[run.cell][k];
    double there = pressure;
    for (int a = 0; a < D; ++a)
      there += particles.pressure_gradient[a][p] * (mesh.points[node][a] - x[a]);
    cell.mean[k] += volume * n[k];
    for (int l = 0; l <= D && !dries; ++l)
      cell.capacity[k][l] += volume * storage * products[k][l];
    const double weight = volume * n[k];
    NodalWater& sum = nodes[node];
    sum.volume += weight;
    sum.pressure += weight * there;
    sum.mobility += weight * mobility * anisotropy.largest;
    sum.compliance += weight * compliance;
  }
}

/// Longest edge over smallest height up to which cells need no more: of squares and cubes cut into cells, 2 and 2.45.
constexpr double regular_cell = 2.5;

/// Longest edge over smallest height, over that, at least 1: flat cells need more projection.
template <int D>
double slenderness(const CellShape<D>& shape, double edge_squared)
{
  return std::max(1.0, std::sqrt(edge_squared) / (regular_cell * smallest_altitude<D>(shape)));
}

/// The projection of a linear pressure has the cell matrix V (delta_kl - 1/(D+1)) / ((D+1) (D+2)), whatever the shape.
template <int D>
void add_projection(const PoreSums<D>& sums, const CellShape<D>& shape, double edge_squared, double dt,
                    PoreCell<D>& cell)
{
  const double margin = 1.5 * sums.swung - 6 * dt * sums.least / edge_squared;
  const double factor = projection_margin * slenderness<D>(shape, edge_squared) * std::max(0.0, margin) / (D + 2);
  for (int k = 0; k <= D; ++k)
    for (int l = 0; l <= D; ++l)
      cell.capacity[k][l] += factor * ((k == l ? 1.0 : 0.0) - 1.0 / (D + 1));
}

/// Stiffness by which a mass resists to displacements that alternate from node to node, over its density [m2/s2]: a
/// step of backward Euler has h^2 / (12 dt^2), h the edge of the cubes of which the cells are cut.
template <class G, int D = G::dim>
double inertia_per_density(double edge_squared, const ImplicitStep<G>& step)
{
  return step.options.quasi_static ? 0 : edge_squared / (12 * D * step.dt * step.dt);
}

/// Sums over the particles of all cells, this rank's part of those over nodes too.
template <class G, int D = G::dim>
std::vector<NodalWater> sum_particles(const Model<G>& model, ImplicitStep<G>& step)
{
  const VelocityField<G>& field = model.fields.front();
  const Mesh<D>& mesh = model.mesh;
  std::vector<NodalWater> nodes(mesh.points.size(), NodalWater{});
  step.pore.cells.assign(static_cast<std::size_t>(mesh.owned_cells), PoreCell<D>{});
  std::vector<PoreSums<D>> sums(step.pore.cells.size());
  for (const Run& run : step.runs)
  {
    const Law& law = model.laws[static_cast<std::size_t>(run.material)];
    const double factor = integration_factor(mesh, field, run.cell);
    const auto standing = standing_water(mesh, *model.water, run.cell);
    const auto anisotropy = anisotropy_of<D>(*model.water, run.material);
    const double per_density = inertia_per_density(longest_edge_squared(mesh.points, mesh.cells[run.cell]), step);
    const bool differs = has_moduli_of_points(law);
    WaveModuli moduli{p_wave_modulus(law), shear_modulus(law)};
    for (Index p = run.first; p < run.last; ++p)
    {
      if (differs)
        moduli = moduli_of_particle(law, model.particles, p);
      const Resistance soil{moduli.p_wave, std::min(moduli.p_wave, 3 * moduli.shear), per_density};
      add_particle<G>(mesh, model.particles, *model.water, run, p, soil, factor, standing, anisotropy,
                      field.moments[run.cell], step.pore.cells[run.cell], sums[static_cast<std::size_t>(run.cell)],
                      nodes);
    }
  }
  for (Index c : step.cells)
  {
    PoreCell<D>& cell = step.pore.cells[c];
    const PoreSums<D>& of_cell = sums[static_cast<std::size_t>(c)];
    add<D>(step.dt, of_cell.mobility, cell.flux);
    cell.compliance = of_cell.compliance;
    add_projection<D>(of_cell, mesh.shapes[c], longest_edge_squared(mesh.points, mesh.cells[c]), step.dt, cell);
  }
  return nodes;
}

/// Weights of the ghost penalty on the pressure increment, as those on the displacement: of its flow, and of its
/// storage in the place of the mass.
template <class G, int D = G::dim>
void weigh_ghosts(const std::vector<NodalWater>& nodes, ImplicitStep<G>& step)
{
  const GhostOptions& options = step.options.ghost;
  step.pore.ghosts.assign(step.ghosts.size(), 0.0);
  for (std::size_t f = 0; f < step.ghosts.size(); ++f)
  {
    const GhostFacet<D>& facet = step.ghosts[f];
    double mobility = 0, compliance = 0;
    for (int k = 0; k < D; ++k) // those on the facet, which both ranks have
    {
      mobility += nodes[facet.nodes[k]].mobility / D;
      compliance += nodes[facet.nodes[k]].compliance / D;
    }
    const double h = facet.size;
    step.pore.ghosts[f] = facet.area * h * (options.stiffness * step.dt * mobility + options.mass * h * h * compliance);
  }
}

/// Nodes whose pressure is prescribed, on any rank's facets, and that pressure.
template <class G, int D = G::dim>
void hold_pressures(const Model<G>& model, NodeExchange& exchange, ImplicitStep<G>& step)
{
  const Mesh<D>& mesh = model.mesh;
  PoreStep<D>& pore = step.pore;
  pore.held.assign(mesh.points.size(), 0);
  pore.prescribed.assign(mesh.points.size(), 0.0);
  for (const PressureCondition& condition : model.water->conditions)
  {
    if (!condition.held)
      continue;
    const std::vector<double> on_facet = nodes_on_facets(mesh, exchange, condition.facet_tag);
    for (std::size_t i = 0; i < on_facet.size(); ++i)
      if (on_facet[i] > 0 && step.active[i])
      {
        const double pressure = pressure_at(condition, *model.water, mesh.points[i][D - 1]);
        if (model.water->may_dry() && condition.is_level && pressure <= 0)
          continue; // dry ground beside the water
        pore.held[i] = 1;
        pore.prescribed[i] = pressure;
      }
  }
}

/// Where the surface of the soil is.
/// @note Collective
template <class G, int D = G::dim>
void find_soil_around(const Mesh<D>& mesh, NodeExchange& exchange, const VelocityField<G>& field, ImplicitStep<G>& step)
{
  PoreStep<D>& pore = step.pore;
  pore.around.assign(mesh.points.size(), SoilAround<D>{});
  for (Index c : step.cells)
    for (int k = 0; k <= D; ++k)
    {
      SoilAround<D>& node = pore.around[mesh.cells[c][k]];
      node.cells += 1;
      for (int a = 0; a < D; ++a)
        node.outward[a] += field.moments[c].volume * dilation_gradient<G>(mesh.shapes[c], k)[a];
    }
  sum_shared(exchange, pore.around);
}

/// Whether nothing determines the pressure: none is prescribed, and a uniform change of it does no work on the
/// displacements that supports leave free.
/// @note Collective
template <class G, int D = G::dim>
bool pressure_is_free(NodeExchange& exchange, const VelocityField<G>& field, const ImplicitStep<G>& step, bool drained)
{
  std::vector<Vector<D>> work;
  for (const SoilAround<D>& node : step.pore.around)
    work.push_back(node.outward);
  std::array<double, 3> largest{}; // held, work, that which supports leave
  const auto note = [&](std::size_t entry)
  {
    for (const Vector<D>& w : work)
      largest[entry] = std::max(largest[entry], norm<D>(w));
  };
  note(1);
  for (Support<D> support : field.supports)
  {
    support.value.fill(0);
    impose<D>(support, work[static_cast<std::size_t>(support.node)]);
  }
  note(2);
  largest[0] = drained || std::ranges::any_of(step.pore.held, [](unsigned char held) { return held != 0; }) ? 1 : 0;
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), 3, MPI_DOUBLE, MPI_MAX, exchange.comm);
  return largest[0] == 0 && largest[2] <= 1e-10 * largest[1];
}

/// Mean size of the cells with soil [m].
/// @note Collective
template <int D>
double mean_size(const Mesh<D>& mesh, std::span<const Index> cells, MPI_Comm comm)
{
  std::array<double, 2> sums{0, static_cast<double>(cells.size())};
  for (Index c : cells)
    sums[0] += cell_size<D>(mesh.shapes[static_cast<std::size_t>(c)].volume);
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 2, MPI_DOUBLE, MPI_SUM, comm);
  return sums[0] / sums[1];
}
} // namespace

template <class G>
void start_pore_water(Model<G>& model, ImplicitStep<G>& step)
{
  auto& pore = step.pore;
  pore.cells.clear();
  pore.drying.clear();
  pore.surface.clear();
  pore.flows = pore.drained = false;
  if (!model.water)
    return;
  std::vector<NodalWater> nodes = sum_particles(model, step);
  find_soil_around(model.mesh, model.exchange, model.fields.front(), step);
  pore.gravity = gravity_at(model, model.time + step.dt);
  pore.density = model.water->density;
  if (step.options.at_rest)
    return;
  sum_shared(model.exchange, nodes);
  pore.start.assign(nodes.size(), 0.0);
  pore.rate.assign(nodes.size(), 0.0);
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (NodalWater& node = nodes[i]; node.volume > 0)
    {
      pore.start[i] = node.pressure / node.volume;
      node.mobility /= node.volume;
      node.compliance /= node.volume;
    }
  pore.drained = model.water->drained_surface;
  if (pore.drained)
  {
    for (auto& contact : model.contacts)
      keep_clearance<G::dim>(model.mesh, contact);
    find_surface<G, G::dim>(model.mesh, model.exchange, nodes, *model.water, model.contacts, step);
  }
  update(step.halos.nodes, pore.start);
  weigh_ghosts(nodes, step);
  pore.flows = true;
  pore.unit = 0;
  for (const Law& law : model.laws)
    pore.unit = std::max(pore.unit, p_wave_modulus(law));
  pore.length = mean_size<G::dim>(model.mesh, step.cells, model.exchange.comm);
  hold_pressures(model, model.exchange, step);
  impose_pressures(step.dt, pore);
  if (std::isinf(model.water->modulus) && !model.water->may_dry() &&
      pressure_is_free(model.exchange, model.fields.front(), step, model.water->drained_surface))
    throw InputError("no pore pressure is prescribed, the water is incompressible and supports are all around: the "
                     "pressure is undetermined; prescribe one by hold_pore_pressure(), or let water be compressible");
}

#define INSTANTIATE(G) template void start_pore_water(Model<G>&, ImplicitStep<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
