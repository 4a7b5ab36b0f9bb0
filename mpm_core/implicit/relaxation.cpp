#include "implicit/relaxation.h"

#include "implicit/inertia.h"
#include "implicit/supported.h"
#include "materials/tools/elasticity.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mpm::implicit
{
namespace
{
constexpr double margin = 1.05;
constexpr double local_damping_fraction = 0.8; ///< beta, the customary value in FLAC

/// Largest sum over a row of vertex k of |elastic stiffness of a whole cell|, and of the part that turns its stress
/// [N/m]
template <class G, int D = G::dim>
double stiffness_row(const CellShape<D>& shape, int k, const ElasticModuli& moduli, double stress)
{
  double largest = 0;
  for (int a = 0; a < D; ++a)
  {
    double sum = 0;
    for (int l = 0; l <= D; ++l)
    {
      const double product = dot<D>(shape.gradient[k], shape.gradient[l]);
      sum += 2 * stress * norm<D>(shape.gradient[k]) * norm<D>(shape.gradient[l]);
      for (int b = 0; b < D; ++b)
      {
        const double hoop_k = a == 0 ? hoop_gradient<G>(shape) : 0, hoop_l = b == 0 ? hoop_gradient<G>(shape) : 0;
        sum += std::abs(moduli.lambda * (shape.gradient[k][a] + hoop_k) * (shape.gradient[l][b] + hoop_l) +
                        moduli.shear * (shape.gradient[k][b] * shape.gradient[l][a] + (a == b ? product : 0) +
                                        2 * hoop_k * hoop_l));
      }
    }
    largest = std::max(largest, sum);
  }
  return cell_volume<G>(shape) * largest;
}

/// Adds the largest sum over a row of |K dt| of the far field at this rank's nodes of its border.
template <int D>
void add_border_rows(const FarField<D>& far, double dt, std::vector<double>& rows)
{
  const auto width = static_cast<std::ptrdiff_t>(far.size * D);
  for (std::size_t k = 0; k < far.nodes.size(); ++k)
  {
    double largest = 0;
    for (int a = 0; a < D; ++a)
    {
      const auto row = far.stiffness.begin() + (static_cast<std::ptrdiff_t>(k) * D + a) * width;
      largest = std::max(largest, std::accumulate(row, row + width, 0.0,
                                                  [](double sum, double entry) { return sum + std::abs(entry); }));
    }
    rows[static_cast<std::size_t>(far.nodes[k])] += dt * largest;
  }
}

/// Bound on the rows of |J| = |dr/dv| at each node [N s/m].
template <class G, int D = G::dim>
std::vector<double> tangent_rows(const Mesh<D>& mesh, const MaterialPoints<D>& points, NodeExchange& exchange,
                                 const VelocityField<G>& field, const ImplicitStep<G>& step)
{
  std::vector<double> rows(mesh.points.size(), 0.0), cell(static_cast<std::size_t>(mesh.owned_cells) * (D + 1), 0.0);
  for (const Run& run : points.runs)
  {
    double stress = 0, filled = 0;
    for (Index p = run.first; p < run.last; ++p)
    {
      filled += points.particles.volume[p];
      for (const Column& column : points.particles.stress)
        stress = std::max(stress, std::abs(column[p]));
    }
    const double shear = shear_modulus(points.laws[run.material]);
    const ElasticModuli moduli{p_wave_modulus(points.laws[run.material]) - 2 * shear, shear};
    const CellShape<D>& shape = mesh.shapes[run.cell];
    const double overfull = std::max(1.0, field.moments[run.cell].volume / cell_volume<G>(shape));
    for (int k = 0; k <= D; ++k)
    {
      double& row = cell[static_cast<std::size_t>(run.cell) * (D + 1) + static_cast<std::size_t>(k)];
      row = std::max(row, overfull * stiffness_row<G>(shape, k, moduli, stress));
    }
  }
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (int k = 0; k <= D; ++k)
      rows[mesh.cells[c][k]] += step.dt * cell[static_cast<std::size_t>(c) * (D + 1) + static_cast<std::size_t>(k)];
  const double inertia = step.options.quasi_static ? 0 : 1 / (step.stage.weight * step.stage.dt);
  for (const GhostFacet<D>& facet : step.ghosts)
  {
    double sum = 0;
    for (double jump : facet.jump)
      sum += std::abs(jump);
    for (int k = 0; k < D + 2; ++k)
      rows[facet.nodes[k]] +=
          facet.fraction[k] * std::abs(facet.jump[k]) * sum * (facet.stiffness * step.dt + facet.mass * inertia);
  }
  add_border_rows(field.far_field, step.dt, rows);
  sum_shared(exchange, rows.data(), 1);
  for (std::size_t i = 0; i < rows.size(); ++i)
    rows[i] += step.options.quasi_static
                   ? 0
                   : stage_inertia(step, field.nodes[i].mass, static_cast<Index>(i), 0, 0).derivative; // at its largest
  return rows;
}

/// Mass by the bound on J: a half at least for first order, a quarter for second order.
constexpr double mass_fraction(RelaxationKind kind)
{
  switch (kind)
  {
  case RelaxationKind::richardson:
    return 0.5;
  case RelaxationKind::local:
    return 0.25 * (1 + local_damping_fraction);
  case RelaxationKind::kinetic: // so that half a pseudo-step from rest brings the fastest mode to its end, and not
                                // beyond
    return 0.5;
  default:
    return 0.25;
  }
}

/// Sum over all nodes, each counted once.
template <class F>
double nodal_sum(const NodeExchange& exchange, F&& term)
{
  double sum = 0;
  for (std::size_t i = 0; i < exchange.owned.size(); ++i)
    if (exchange.owned[i])
      sum += term(i);
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, exchange.comm);
  return sum;
}

/// c of Underwood (1983), critical for the mode that the iteration moves in: 2 sqrt(w J w / w M w), J w from the last
/// change of r.
template <class G, int D = G::dim>
double critical_damping(const NodeExchange& exchange, const ImplicitStep<G>& step, const Relaxation<D>& relaxation)
{
  const double stiffness = nodal_sum(exchange,
                                     [&](std::size_t i)
                                     {
                                       double sum = 0;
                                       for (int a = 0; a < D; ++a)
                                         sum += relaxation.rate[i][a] * (relaxation.last[i][a] - step.residual[i][a]);
                                       return sum;
                                     });
  const double mass = nodal_sum(exchange, [&](std::size_t i)
                                { return relaxation.mass[i] * dot<D>(relaxation.rate[i], relaxation.rate[i]); });
  return mass > 0 ? std::min(1.9, 2 * std::sqrt(std::max(0.0, stiffness / mass))) : 0;
}

/// Damping of the kind in the next iteration. Kinetic: 1 where the body has passed a peak of its kinetic energy, as the
/// power of the residual says, else 0.
template <class G, int D = G::dim>
double next_damping(const NodeExchange& exchange, const ImplicitStep<G>& step, const Relaxation<D>& relaxation)
{
  switch (relaxation.kind)
  {
  case RelaxationKind::viscous:
    return critical_damping(exchange, step, relaxation);
  case RelaxationKind::kinetic:
    return nodal_sum(exchange, [&](std::size_t i) { return dot<D>(relaxation.rate[i], step.residual[i]); }) < 0 ? 1 : 0;
  default:
    return local_damping_fraction;
  }
}

/// The next w of one node.
template <int D>
Vector<D> next_rate(RelaxationKind kind, const Vector<D>& rate, const Vector<D>& residual, double mass, double damping)
{
  Vector<D> next{};
  for (int a = 0; a < D; ++a)
    switch (kind)
    {
    case RelaxationKind::richardson:
      next[a] = residual[a] / mass;
      break;
    case RelaxationKind::local:
      next[a] =
          rate[a] + (residual[a] - (rate[a] == 0 ? 0 : std::copysign(damping * std::abs(residual[a]), rate[a]))) / mass;
      break;
    case RelaxationKind::kinetic:
      next[a] =
          damping > 0 ? 0.5 * residual[a] / mass : rate[a] + residual[a] / mass; // from rest, at half a pseudo-step
      break;
    case RelaxationKind::viscous:
      next[a] = ((2 - damping) * rate[a] + 2 * residual[a] / mass) / (2 + damping);
      break;
    }
  return next;
}

} // namespace

template <class G, int D>
Relaxation<D> start_relaxation(Model<G>& model, ImplicitStep<G>& step, RelaxationKind kind)
{
  Relaxation<D> relaxation{
      kind, tangent_rows(model.mesh, points_of(model, step), model.exchange, model.fields.front(), step), {}, {}, {}};
  for (double& mass : relaxation.mass)
    mass *= margin * mass_fraction(kind);
  relaxation.rate.assign(model.mesh.points.size(), {});
  relaxation.last.assign(model.mesh.points.size(), {});
  relaxation.report = find_residual(model, step, false);
  return relaxation;
}

template <class G, int D>
int relax(Model<G>& model, ImplicitStep<G>& step, Relaxation<D>& relaxation, double tolerance, int most)
{
  int done = 0;
  while (done < most && relaxation.report.residual > tolerance * relaxation.report.scale &&
         relaxation.report.failed == 0)
  {
    const double damping = next_damping(model.exchange, step, relaxation);
    for (std::size_t i = 0; i < relaxation.rate.size(); ++i)
    {
      if (!step.active[i])
        continue;
      relaxation.rate[i] =
          next_rate<D>(relaxation.kind, relaxation.rate[i], step.residual[i], relaxation.mass[i], damping);
      for (int a = 0; a < D; ++a)
        model.fields.front().velocity[i][a] += relaxation.rate[i][a];
    }
    impose_supports(step, model.fields.front());
    relaxation.last = step.residual;
    relaxation.report = find_residual(model, step, false);
    ++done;
  }
  return done;
}

#define INSTANTIATE(G)                                                                                                 \
  template Relaxation<G::dim> start_relaxation(Model<G>&, ImplicitStep<G>&, RelaxationKind);                           \
  template int relax(Model<G>&, ImplicitStep<G>&, Relaxation<G::dim>&, double, int);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
} // namespace mpm::implicit
