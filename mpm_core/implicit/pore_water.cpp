#include "implicit/pore_water.h"

namespace mpm::implicit
{
template <class G>
Vector<G::dim> water_weight(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                            Index cell)
{
  constexpr int D = G::dim;
  Vector<D> weight = step.pore.gravity;
  const PoreCell<D>& pore = step.pore.cells[cell];
  const double per_volume = step.options.quasi_static ? 0 : 1 / (volume_of(pore) * step.stage.dt);
  for (int k = 0; k <= D && !step.options.quasi_static; ++k)
    for (int a = 0; a < D; ++a)
    {
      const Index node = mesh.cells[cell][k];
      weight[a] -= pore.mean[k] * per_volume * (end_velocity(step, field, node, a) - step.stage.start[node][a]);
    }
  for (double& component : weight)
    component *= step.pore.density;
  return weight;
}

template <class G>
Vector<G::dim> driving_gradient(const Mesh<G::dim>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                                Index cell)
{
  constexpr int D = G::dim;
  const Vector<D> weight = water_weight(mesh, field, step, cell);
  Vector<D> gradient;
  for (int a = 0; a < D; ++a)
    gradient[a] = -weight[a];
  for (int k = 0; k <= D; ++k)
  {
    const double pressure = end_pressure(step.pore, mesh.cells[cell][k], step.dt);
    for (int a = 0; a < D; ++a)
      gradient[a] += pressure * mesh.shapes[cell].gradient[k][a];
  }
  return gradient;
}

template <class G, int D>
double volume_strain(const Mesh<D>& mesh, const VelocityField<G>& field, double dt, Index cell)
{
  double strain = 0;
  for (int k = 0; k <= D; ++k)
    strain += dt * dot<D>(dilation_gradient<G>(mesh.shapes[cell], k), field.velocity[mesh.cells[cell][k]]);
  return strain;
}

template <class G, int D>
double pressure_sum(const Mesh<D>& mesh, const ImplicitStep<G>& step, Index c)
{
  if (!step.pore.drying.empty())
    return step.pore.drying[c].pressure;
  double pressure = step.pore.cells[c].load.pressure;
  for (int k = 0; k <= D && step.pore.flows; ++k)
    pressure += step.pore.cells[c].mean[k] * step.dt * step.pore.rate[mesh.cells[c][k]];
  return pressure;
}

namespace
{
template <class G, int D = G::dim>
void add_surface_content(const Mesh<D>& mesh, const ImplicitStep<G>& step, std::vector<double>& content)
{
  for (const SurfacePoint<D>& point : step.pore.surface)
  {
    const double outflow = outflow_at(point, excess_pressure(mesh, step.pore, point, step.dt));
    for (int k = 0; k <= D; ++k)
      content[mesh.cells[point.cell][k]] += point.shape[k] * outflow;
  }
}

template <class G, int D = G::dim>
void add_ghost_content(const ImplicitStep<G>& step, std::vector<double>& content)
{
  for (std::size_t f = 0; f < step.ghosts.size(); ++f)
  {
    const GhostFacet<D>& facet = step.ghosts[f];
    double jump = 0;
    for (int k = 0; k < D + 2; ++k)
      jump += facet.jump[k] * step.dt * step.pore.rate[facet.nodes[k]];
    for (int k = 0; k < D + 2; ++k)
      content[facet.nodes[k]] += facet.fraction[k] * facet.jump[k] * step.pore.ghosts[f] * jump;
  }
}
} // namespace

template <class G, int D>
void add_pore_forces(const Mesh<D>& mesh, const ImplicitStep<G>& step, std::vector<NodalForces<D>>& forces)
{
  if (step.pore.cells.empty())
    return;
  for (Index c : step.cells)
  {
    const PoreCell<D>& cell = step.pore.cells[c];
    const double pressure = pressure_sum(mesh, step, c);
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> dilation = dilation_gradient<G>(mesh.shapes[c], k);
      Vector<D>& internal = forces[mesh.cells[c][k]].internal;
      for (int a = 0; a < D; ++a)
        internal[a] += cell.load.volume[k] * cell.load.gradient[a] - pressure * dilation[a];
    }
  }
}

template <class G, int D>
void find_water_balance(const Mesh<D>& mesh, NodeExchange& exchange, const VelocityField<G>& field,
                        ImplicitStep<G>& step)
{
  PoreStep<D>& pore = step.pore;
  if (!pore.flows)
    return;
  pore.content.assign(mesh.points.size(), 0.0);
  pore.flow_squares = 0;
  for (Index c : step.cells)
  {
    const PoreCell<D>& cell = pore.cells[c];
    const auto& nodes = mesh.cells[c];
    const Vector<D> drive = driving_gradient(mesh, field, step, c);
    const double dilation = volume_strain(mesh, field, step.dt, c);
    double conductance = 0, pressure = 0;
    for (int k = 0; k <= D; ++k)
    {
      conductance += flow<D>(flux_of(pore, c), mesh.shapes[c].gradient[k], mesh.shapes[c].gradient[k]);
      pressure = std::max(pressure, std::abs(end_pressure(pore, nodes[k], step.dt)));
      double& content = pore.content[nodes[k]];
      content += pore.drying.empty() ? cell.mean[k] * dilation : pore.drying[c].content[k];
      content += flow<D>(flux_of(pore, c), mesh.shapes[c].gradient[k], drive);
      for (int l = 0; l <= D; ++l)
        content += cell.capacity[k][l] * step.dt * pore.rate[nodes[l]];
    }
    pore.flow_squares += conductance * conductance * pressure * pressure;
  }
  add_surface_content(mesh, step, pore.content);
  add_ghost_content(step, pore.content);
  sum_shared(exchange, pore.content);
}

namespace
{
/// What leaves at the free surface by the pressures at the end [m3/Pa]: of each owned cell, and of nodes alone.
template <int D>
struct SurfaceEntries
{
  std::vector<std::array<std::array<double, D + 1>, D + 1>> cells; ///< empty where the surface is not drained
  std::vector<double> nodes;
};

template <class G, int D = G::dim>
SurfaceEntries<D> surface_entries(const Mesh<D>& mesh, const ImplicitStep<G>& step)
{
  const PoreStep<D>& pore = step.pore;
  SurfaceEntries<D> entries;
  if (!pore.drained)
    return entries;
  entries.cells.resize(pore.cells.size());
  entries.nodes.resize(mesh.points.size());
  for (const SurfacePoint<D>& point : pore.surface)
    for (int k = 0; k <= D && !point.takes_rain; ++k)
    {
      if (volume_of(pore.cells[point.cell]) == 0)
        entries.nodes[mesh.cells[point.cell][k]] += point.weight * point.shape[k];
      for (int l = 0; l <= D; ++l)
        entries.cells[point.cell][k][l] += point.weight * point.shape[k] * point.shape[l];
    }
  return entries;
}

/// Derivatives of the water balance of vertex k of a cell by displacement and pressure of vertex l; see (W4).
template <class G, int D = G::dim>
void add_cell_block(const Mesh<D>& mesh, const ImplicitStep<G>& step, Index c, const Vector<G::dim>& drive, int k,
                    int l, const SurfaceEntries<D>& surface, TangentSum<D>& tangent)
{
  const PoreStep<D>& pore = step.pore;
  const bool dries = !pore.drying.empty();
  const PoreCell<D>& cell = pore.cells[c];
  const CellShape<D>& shape = mesh.shapes[c];
  const Index row = mesh.cells[c][k], column = mesh.cells[c][l];
  const double unit = pore.unit;
  const double volume = volume_of(cell);
  const Matrix<D>& flux = flux_of(pore, c);
  const double inertia = step.options.quasi_static
                             ? 0
                             : pore.density * cell.mean[l] / (volume * step.stage.weight * step.stage.dt * step.dt);
  const Vector<D> dilation = dilation_gradient<G>(shape, k);
  Vector<D> by_own, volumes = dilation_gradient<G>(shape, l);
  const Vector<D> outflow = product<D>(flux, shape.gradient[k]);
  for (int a = 0; a < D; ++a)
  {
    by_own[a] = pressure_by_node(pore, c, l) * dilation[a];
    const double wet = !dries             ? cell.mean[k]
                       : step.options.nmd ? 0
                                          : pore.drying[c].wet[k]; // averaged: see averaging.h
    volumes[a] = pore.held[row] ? 0 : -unit * (wet * volumes[a] + inertia * outflow[a]);
  }
  double water = cell.capacity[k][l] + flow<D>(flux, shape.gradient[k], shape.gradient[l]);
  if (dries)
    water += pore.drying[c].capacity[k][l] + flow<D>(pore.drying[c].flux_by_pressure[l], shape.gradient[k], drive);
  if (pore.drained)
    water += surface.cells[c][k][l];
  double by_pressure = -unit * unit * water;
  if (pore.held[row] || pore.held[column])
    by_pressure = row == column ? -unit * cell.mean[k] : 0;
  tangent.add_coupled(row, column, column_of_pressure<D>(pore, column, by_own), volumes, by_pressure);
}

/// The ghost penalty of the pressures.
template <class G, int D = G::dim>
void add_ghost_pressures(const ImplicitStep<G>& step, TangentSum<D>& tangent)
{
  const PoreStep<D>& pore = step.pore;
  for (std::size_t f = 0; f < step.ghosts.size(); ++f)
  {
    const GhostFacet<D>& facet = step.ghosts[f];
    for (int k = 0; k < D + 2; ++k)
      for (int l = 0; l < D + 2 && facet.fraction[k] != 0; ++l)
      {
        const bool held = pore.held[facet.nodes[k]] || pore.held[facet.nodes[l]];
        const double weight = held ? 0 : -pore.unit * pore.unit * pore.ghosts[f] * facet.fraction[k];
        tangent.add_pressure(facet.nodes[k], facet.nodes[l], weight * facet.jump[k] * facet.jump[l]);
      }
  }
}
} // namespace

template <class G, int D>
void add_pore_entries(const Mesh<D>& mesh, const VelocityField<G>& field, const ImplicitStep<G>& step,
                      TangentSum<D>& tangent)
{
  if (!step.pore.flows)
    return;
  const SurfaceEntries<D> surface = surface_entries(mesh, step);
  for (Index c : step.cells)
  {
    const Vector<D> drive = step.pore.drying.empty() ? Vector<D>{} : driving_gradient(mesh, field, step, c);
    for (int k = 0; k <= D; ++k)
      for (int l = 0; l <= D; ++l)
        add_cell_block(mesh, step, c, drive, k, l, surface, tangent);
  }
  for (Index i = 0; i < static_cast<Index>(surface.nodes.size());
       ++i) // whichever have an entry: contributions keep order
    if (step.active[i])
      tangent.add_pressure(i, i, step.pore.held[i] ? 0 : -step.pore.unit * step.pore.unit * surface.nodes[i]);
  add_ghost_pressures(step, tangent);
}

template <int D>
void impose_pressures(double dt, PoreStep<D>& pore)
{
  for (std::size_t i = 0; i < pore.held.size(); ++i)
    if (pore.held[i])
      pore.rate[i] = (pore.prescribed[i] - pore.start[i]) / dt;
}

template void impose_pressures(double, PoreStep<2>&);
template void impose_pressures(double, PoreStep<3>&);
#define INSTANTIATE(G)                                                                                                 \
  template Vector<G::dim> water_weight(const Mesh<G::dim>&, const VelocityField<G>&, const ImplicitStep<G>&, Index);   \
  template Vector<G::dim> driving_gradient(const Mesh<G::dim>&, const VelocityField<G>&, const ImplicitStep<G>&,       \
                                           Index);                                                                     \
  template void add_pore_forces(const Mesh<G::dim>&, const ImplicitStep<G>&, std::vector<NodalForces<G::dim>>&);       \
  template void find_water_balance(const Mesh<G::dim>&, NodeExchange&, const VelocityField<G>&, ImplicitStep<G>&);     \
  template double pressure_sum(const Mesh<G::dim>&, const ImplicitStep<G>&, Index);                                    \
  template double volume_strain(const Mesh<G::dim>&, const VelocityField<G>&, double, Index);                          \
  template void add_pore_entries(const Mesh<G::dim>&, const VelocityField<G>&, const ImplicitStep<G>&,                 \
                                 TangentSum<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
