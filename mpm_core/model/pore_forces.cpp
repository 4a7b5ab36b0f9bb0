#include "model/pore_forces.h"

#include "model/integration.h"

#include <algorithm>

namespace mpm::model
{
template <class G, int D>
void add_pore_forces(const Mesh<D>& mesh, const Particles<D>& particles, const PoreWater& water,
                     const std::vector<Run>& runs, VelocityField<G>& field)
{
  if (particles.water_velocity.present)
    return;
  for (const Run& run : runs)
  {
    const double factor = integration_factor(mesh, field, run.cell);
    const auto standing = standing_water(mesh, water, run.cell);
    PoreLoad<D> load{};
    for (Index p = run.first; p < run.last; ++p)
      add_pore_load(mesh.shapes[run.cell], particles, water, standing, field.moments[run.cell], run.material, p,
                    factor * particles.volume[p], load);
    Working<G> stress{};
    for (int k : normal_component<G>)
      stress[k] = -load.pressure;
    for (int k = 0; k <= D; ++k)
    {
      const Vector<D> force = internal_force<G>(stress, mesh.shapes[run.cell], k);
      Vector<D>& internal = field.nodes[mesh.cells[run.cell][k]].internal;
      for (int a = 0; a < D; ++a)
        internal[a] += force[a] + load.volume[k] * load.gradient[a];
    }
  }
}

template <class G, int D>
void add_standing_forces(const Mesh<D>& mesh, const Particles<D>& particles, const PoreWater& water,
                         const std::vector<Run>& runs, const VelocityField<G>& field, Array<NodeSums<D>>& nodes)
{
  for (const Run& run : runs)
  {
    const double factor = integration_factor(mesh, field, run.cell);
    const auto standing = standing_water(mesh, water, run.cell);
    if (std::ranges::all_of(standing.pressure, [](double pressure) { return pressure == 0; }))
      continue;
    double pressure = 0;
    std::array<double, D + 1> volume{};
    for (Index p = run.first; p < run.last; ++p)
    {
      const auto n = shape_functions<D>(mesh.shapes[run.cell], at<D>(particles.position, p));
      pressure += factor * particles.volume[p] * pressure_at<D>(standing, n);
      for (int k = 0; k <= D; ++k)
        volume[k] += particles.volume[p] * n[k];
    }
    for (int k = 0; k <= D; ++k)
      for (int a = 0; a < D; ++a)
        nodes[mesh.cells[run.cell][k]].traction[a] -=
            pressure * dilation_gradient<G>(mesh.shapes[run.cell], k)[a] + volume[k] * standing.gradient[a];
  }
}

namespace
{
/// Integral of N_i N_j over a facet of unit measure, with weights r_m of its vertices; in axial symmetry their radii.
template <int D>
double product_integral(int i, int j, const std::array<double, D>& r)
{
  constexpr double whole = D == 2 ? 24 : 60; // (D + 2)! / (D - 1)!
  double sum = 0;
  for (int m = 0; m < D; ++m)
  {
    const int equal = (i == j) + (j == m) + (i == m);
    sum += r[m] * (equal == 3 ? 6 : equal == 1 ? 2 : 1) / whole;
  }
  return sum;
}

/// Forces of a pressure on the facet of a cell opposite to vertex k.
template <class G, int D = G::dim>
void press(const Mesh<D>& mesh, const PressureCondition& condition, const PoreWater& water, Index cell, int k,
           Array<NodeSums<D>>& nodes)
{
  const auto corners = facet_nodes<D>(mesh.cells[cell], k);
  const CellShape<D>& shape = mesh.shapes[cell];
  std::array<double, D> pressure, weight;
  for (int i = 0; i < D; ++i)
  {
    pressure[i] = pressure_at(condition, water, mesh.points[corners[i]][D - 1]);
    weight[i] = thickness<G>(mesh.points[corners[i]]);
  }
  for (int i = 0; i < D; ++i)
  {
    double sum = 0;
    for (int j = 0; j < D; ++j)
      sum += pressure[j] * product_integral<D>(i, j, weight);
    for (int a = 0; a < D; ++a) // the inward normal times the area is D V grad N_k
      nodes[corners[i]].traction[a] += sum * D * shape.volume * shape.gradient[k][a];
  }
}
} // namespace

template <class G>
void add_surface_pressures(const Mesh<G::dim>& mesh, const PoreWater& water, bool PressureCondition::*acting,
                           VelocityField<G>& field)
{
  for (const PressureCondition& condition : water.conditions)
    for (Index c = 0; c < mesh.owned_cells && condition.*acting; ++c)
      for (int k = 0; k <= G::dim && field.moments[c].volume > 0; ++k)
        if (mesh.facet_tags[c][k] == condition.facet_tag)
          press<G>(mesh, condition, water, c, k, field.nodes);
}

#define INSTANTIATE(G)                                                                                                 \
  template void add_standing_forces<G>(const Mesh<G::dim>&, const Particles<G::dim>&, const PoreWater&,                \
                                       const std::vector<Run>&, const VelocityField<G>&, Array<NodeSums<G::dim>>&);    \
  template void add_surface_pressures(const Mesh<G::dim>&, const PoreWater&, bool PressureCondition::*,                \
                                      VelocityField<G>&);                                                              \
  template void add_pore_forces(const Mesh<G::dim>&, const Particles<G::dim>&, const PoreWater&,                       \
                                const std::vector<Run>&, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
