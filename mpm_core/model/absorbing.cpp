#include "model/absorbing.h"

#include "base/eigen.h"
#include "model/mapping.h"
#include "parallel/agreement.h"

#include <cmath>

namespace mpm::model
{
namespace
{
/// Dashpot and spring of a node, as plain doubles: one message for nodes that ranks share.
template <int D>
struct NodeOfSide
{
  Matrix<D> damping;
  Matrix<D> stiffness;
  double is_on_side;
};

/// Number of the law of the soil in each owned cell; `none` in empty ones.
template <class G>
std::vector<Index> law_of_cell(const Model<G>& model)
{
  std::vector<Index> laws(static_cast<std::size_t>(model.mesh.owned_cells), none);
  for (const std::span<const Run> runs : {std::span(model.order.runs), std::span(model.fields.front().resting.runs)})
    for (const Run& run : runs)
      laws[static_cast<std::size_t>(run.cell)] = run.material;
  return laws;
}

/// Adds the facet of a cell opposite to vertex k: its vertices have equal parts of its area.
template <int D>
void add_facet(const Mesh<D>& mesh, const AbsorbingSide& side, Index cell, int k, double density, const Law& law,
               std::vector<NodeOfSide<D>>& nodes)
{
  const CellShape<D>& shape = mesh.shapes[cell];
  const double size = norm<D>(shape.gradient[k]), area = size * shape.volume; // D V |grad N_k| over D vertices
  const double moduli[]{p_wave_modulus(law), shear_modulus(law)};
  const double given[]{side.normal_impedance, side.shear_impedance};
  std::array<double, 2> damping, stiffness;
  for (int s = 0; s < 2; ++s)
  {
    damping[s] = area * (given[s] > 0 ? given[s] : std::sqrt(density * moduli[s]));
    stiffness[s] = area * moduli[s] / side.thickness;
  }
  for (Index node : facet_nodes<D>(mesh.cells[cell], k))
  {
    nodes[node].is_on_side = 1;
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
      {
        const double normal = shape.gradient[k][i] * shape.gradient[k][j] / (size * size);
        const double along = (i == j ? 1.0 : 0.0) - normal;
        nodes[node].damping[i][j] += damping[0] * normal + damping[1] * along;
        nodes[node].stiffness[i][j] += stiffness[0] * normal + stiffness[1] * along;
      }
  }
}

/// @returns number of facets of soil on the side, of this rank
template <class G, int D = G::dim>
int add_side(const Model<G>& model, const AbsorbingSide& side, std::span<const Index> laws,
             std::vector<NodeOfSide<D>>& nodes)
{
  int facets = 0;
  const auto& moments = model.fields.front().moments;
  for (Index c = 0; c < model.mesh.owned_cells; ++c)
    for (int k = 0; k <= D; ++k)
      if (const Index law = laws[static_cast<std::size_t>(c)];
          law != none && model.mesh.facet_tags[c][k] == side.facet_tag)
      {
        const double density = moments[c].mass / moments[c].volume;
        add_facet<D>(model.mesh, side, c, k, density, model.laws[static_cast<std::size_t>(law)], nodes);
        ++facets;
      }
  return facets;
}

/// What is left of the forces at a node, and would accelerate it.
template <int D>
Vector<D> residual_of(const NodeSums<D>& node, const Vector<D>& gravity)
{
  Vector<D> residual;
  for (int a = 0; a < D; ++a)
    residual[a] = node.traction[a] + node.mass * gravity[a] - node.internal[a];
  return residual;
}
} // namespace

template <class G>
void set_absorbing_sides(Model<G>& model, std::span<const AbsorbingSide> sides, const Vector<G::dim>& gravity)
{
  constexpr int D = G::dim;
  VelocityField<G>& field = model.fields.front();
  if (G::has_hoop || model.fields.size() > 1)
    throw InputError(
        "sides are to absorb waves in axial symmetry or with several velocity fields, expected plane strain "
        "or three dimensions and one field");
  prepare(model);
  map_to_nodes(model);
  std::vector<NodeOfSide<D>> nodes(model.mesh.points.size(), NodeOfSide<D>{});
  const std::vector<Index> laws = law_of_cell(model);
  for (const AbsorbingSide& side : sides)
  {
    int facets = add_side<G>(model, side, laws, nodes);
    MPI_Allreduce(MPI_IN_PLACE, &facets, 1, MPI_INT, MPI_SUM, model.exchange.comm);
    if (facets == 0)
      throw InputError("facet_tag " + std::to_string(side.facet_tag) +
                       " has no soil at its facets, expected particles in the cells at a side that absorbs");
  }
  sum_shared(model.exchange, nodes);
  field.dashpots.clear();
  for (std::size_t i = 0; i < nodes.size(); ++i)
  {
    if (nodes[i].is_on_side == 0)
      continue;
    Vector<D> held = residual_of<D>(field.nodes[i], gravity);
    for (double& component : held)
      component = -component;
    field.dashpots.push_back({static_cast<Index>(i), nodes[i].damping, nodes[i].stiffness, held, {}});
  }
}

template <class G>
void add_dashpot_forces(const Vector<G::dim>& gravity, double time, double dt, VelocityField<G>& field)
{
  constexpr int D = G::dim;
  const Vector<D> incoming = field.incoming.at(time + 0.5 * dt);
  for (const DashpotNode<D>& dashpot : field.dashpots)
  {
    NodeSums<D>& node = field.nodes[dashpot.node];
    if (is_light(field, dashpot.node))
      continue;
    // m a = R + f,  f = held - K u - C (v + dt a / 2 - 2 v_in)
    Vector<D> against;
    for (int a = 0; a < D; ++a)
      against[a] = field.start_velocity[dashpot.node][a] - 2 * incoming[a];
    const Vector<D> drag = product<D>(dashpot.damping, against),
                    spring = product<D>(dashpot.stiffness, dashpot.displacement),
                    residual = residual_of<D>(node, gravity);
    Eigen::Matrix<double, D, D> inertia = 0.5 * dt * as_eigen<D>(dashpot.damping);
    Eigen::Matrix<double, D, 1> force;
    for (int a = 0; a < D; ++a)
    {
      inertia(a, a) += node.mass;
      force[a] = residual[a] + dashpot.held[a] - spring[a] - drag[a];
    }
    const Eigen::Matrix<double, D, 1> acceleration = inertia.inverse() * force;
    for (int a = 0; a < D; ++a)
      node.traction[a] += node.mass * acceleration[a] - residual[a];
  }
}

template <class G>
void move_springs(double dt, VelocityField<G>& field)
{
  for (auto& dashpot : field.dashpots)
    for (int a = 0; a < G::dim; ++a)
      dashpot.displacement[a] += dt * field.velocity[dashpot.node][a];
}

#define INSTANTIATE(G)                                                                                                 \
  template void set_absorbing_sides(Model<G>&, std::span<const AbsorbingSide>, const Vector<G::dim>&);                 \
  template void add_dashpot_forces(const Vector<G::dim>&, double, double, VelocityField<G>&);                          \
  template void move_springs(double, VelocityField<G>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::model
