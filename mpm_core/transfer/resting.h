#pragma once
/// @file
/// What the nodes need to know of resting cells, each with its one row.
///
/// A resting cell stands for n particles at the points of a rule (`even_points`) and of equal density, which do not
/// move relative to the cell. Its moments are those of these particles: volume and mass of the row, first and second
/// moment of mass of the rule, and the velocities v + grad v . xi. So nodes cannot tell a resting cell from its
/// particles, and nothing changes for them when one takes the place of the other. In axial symmetry the mass of a
/// particle is in proportion to its radius; elsewhere the first moment is zero.
///
/// As these particles stay where they are, neither the mass of nodes nor the mass matrix changes. So a step is that of
/// linear finite elements: nodes keep the momentum of resting cells, and what has been added to velocities and
/// displacements; rows learn of it only when somebody asks (model/resting_nodes.h).

#include "particles/batches.h"
#include "transfer/moments.h"
#include "transfer/nodes.h"

#include <map>

namespace mpm::transfer
{
/// The places of particles in a cell, in barycentric coordinates.
template <int D>
using Rule = std::vector<std::array<double, D + 1>>;

/// By the number of points.
template <int D>
using Rules = std::map<int, Rule<D>>;

/// @throws InputError a number of points that no rule has
template <int D>
const Rule<D>& rule_of(int points, Rules<D>& rules);

/// Fractions of the mass and volume of a cell that its particles at the points of a rule have.
template <class G, int D = G::dim>
std::vector<double> rule_weights(const Mesh<D>& mesh, Index cell, const Rule<D>& rule);

/// Gives moments the mass of a cell's particles at the points of a rule, and its moments.
template <class G, int D = G::dim>
void take_mass(const Mesh<D>& mesh, Index cell, double mass, const Rule<D>& rule, CellMoments<G>& moments);

/// The resting cells of a velocity field, in rising order. Entries per cell are followed by some of zero, so that the
/// last ones fill a vector.
template <int D>
struct RestingCells
{
  std::vector<unsigned char> marks; ///< per owned cell: 1 where it rests; empty where no cell of the model may
  std::vector<Run> runs;            ///< the row of each
  std::vector<Batch> batches;       ///< of these rows

  MeshPart others; ///< the field's part of the mesh without them; nodes are those of the whole part

  // Per cell
  std::vector<std::array<Index, D + 1>> vertices;
  std::array<std::vector<double>, D * D> gradient; ///< of the shape functions of all vertices but the first
  std::vector<double> hoop;                        ///< strain by a radial velocity of a vertex, in axial symmetry

  // Per node
  std::vector<Index> nodes;            ///< of these cells
  std::vector<Index> rows;             ///< where the entries of nodes[n] in the mass matrix begin, and the end
  std::vector<Index> columns;          ///< node j of each entry
  std::vector<double> masses;          ///< sum m_p N_i N_j
  std::vector<NodeSums<D>> sums;       ///< of these cells as they are now; without tractions
  std::vector<Vector<D>> change;       ///< of velocities, that rows do not know yet
  std::vector<Vector<D>> displacement; ///< likewise [m]

  double flip_fraction = 1; ///< by which the velocities of rows are to be multiplied before `change` is added
  bool has_gained = false;  ///< sums and `change` are those of the end of the step under way
  bool is_behind = false;   ///< rows are behind their nodes
};

/// Gives moments what the row of a resting cell says; those of mass stay.
template <class G, int D = G::dim>
void take_row(const Particles<D>& particles, Index row, CellMoments<G>& moments);

/// Moves a resting cell with its nodes: velocities as (18), while its centre stays and displacements add up.
template <int D>
void move_row(Particles<D>& particles, Index row, const CellMotion<D>& motion);

/// Gradient in the row of a resting cell.
template <int D>
inline Matrix<D> gradient_at(const OptionalColumns<D * D>& columns, Index row)
{
  Matrix<D> gradient;
  for (int k = 0; k < D * D; ++k)
    gradient[k / D][k % D] = columns[static_cast<std::size_t>(k)][row];
  return gradient;
}

/// Product of the gradients of two scalars, a . S b of the second moment S = sum m_p xi (x) xi.
template <int D>
inline double relative_product(const Vector<D>& a, const Vector<D>& b,
                               const std::array<double, n_symmetric<D>>& second_moment)
{
  double sum = 0;
  for (int j = 0; j < D; ++j)
    for (int k = 0; k < D; ++k)
      sum += a[j] * second_moment[symmetric_index<D>(j, k)] * b[k];
  return sum;
}

/// An affine scalar in a cell: value + gradient . xi
template <int D>
struct AffineScalar
{
  double value;
  Vector<D> gradient;
};

/// sum m_p a_p b_p of two affine scalars over a cell's particles.
template <class G, int D = G::dim>
inline double sum_of_products(const AffineScalar<D>& a, const AffineScalar<D>& b, const CellMoments<G>& moments)
{
  return moments.mass * a.value * b.value + a.value * dot<D>(b.gradient, moments.mass_xi) +
         b.value * dot<D>(a.gradient, moments.mass_xi) + relative_product<D>(a.gradient, b.gradient, moments.mass_xixi);
}
} // namespace mpm::transfer
