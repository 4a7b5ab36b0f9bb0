#pragma once
/// @file
/// Cell moments: all that the nodes need to know of the particles in a cell.
///
/// A linear shape function is affine inside a cell, so each nodal sum over the particles of a cell, such as
/// sum m_p N_i(x_p), follows from a few moments of the particles about the cell's centre. They are summed in one pass
/// over the particles and scattered to nodes once per cell, instead of evaluating shape functions per particle and
/// node.

#include "mesh/mesh.h"
#include "particles/particles.h"

#include <bit>

namespace mpm::transfer
{
/// Moments of the particles in one cell; xi is the position from the cell's centre.
template <class G>
struct CellMoments
{
  static constexpr int D = G::dim;
  double volume;                                ///< sum V_p
  double mass;                                  ///< sum m_p
  Vector<D> mass_xi;                            ///< sum m_p xi
  std::array<double, n_symmetric<D>> mass_xixi; ///< sum m_p xi (x) xi
  Vector<D> momentum;                           ///< sum m_p v_p
  Matrix<D> momentum_xi;                        ///< sum m_p v_p (x) xi; [component of v][component of xi]
  Working<G> stress;                            ///< sum V_p sigma_p
};

/// Moments of the tractions in one cell.
template <int D>
struct TractionMoments
{
  Vector<D> force;    ///< sum t_p
  Matrix<D> force_xi; ///< sum t_p (x) xi
};

/// An affine vector field in a cell: value + gradient . xi
template <int D>
struct AffineField
{
  Vector<D> value;
  Matrix<D> gradient;
};

template <int D>
inline AffineField<D> scaled(AffineField<D> field, double factor)
{
  for (int a = 0; a < D; ++a)
  {
    field.value[a] *= factor;
    for (int b = 0; b < D; ++b)
      field.gradient[a][b] *= factor;
  }
  return field;
}

/// Motion of a cell's particles over a step: v_p = flip_fraction v_p + change(x_p), x_p += displacement(x_p)
template <int D>
struct CellMotion
{
  double flip_fraction; ///< 1 - PIC fraction
  AffineField<D> change;
  AffineField<D> displacement;
};

/// Adds the particles [first, last), all in this cell, to its moments.
template <class G, int D = G::dim>
void add_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                 CellMoments<G>& moments);

/// Raises `largest` to the magnitudes of what each of the particles [first, last) adds to the moments of their cell.
template <class G, int D = G::dim>
void keep_largest_terms(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                        CellMoments<G>& largest);

/// Adds the particles [first, last) to the moments of their cell, each term rounded as `add_rounded` does.
/// @param largest  terms of all particles of the cell
template <class G, int D = G::dim>
void add_rounded_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                         const CellMoments<G>& largest, CellMoments<G>& moments);

/// Adds the tractions that particles carry.
template <int D>
void add_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                 TractionMoments<D>& moments);

/// Takes moments of the same cell out of others, such as those of a particle that leaves it.
template <class Moments>
inline void take_out(const Moments& part, Moments& moments)
{
  using Numbers = std::array<double, sizeof(Moments) / sizeof(double)>;
  auto numbers = std::bit_cast<Numbers>(moments);
  const auto out = std::bit_cast<Numbers>(part);
  for (std::size_t k = 0; k < numbers.size(); ++k)
    numbers[k] -= out[k];
  moments = std::bit_cast<Moments>(numbers);
}

/// What the moments become when all particles of the cell move; stresses and volumes stay. The particles are not
/// visited.
template <class G, int D = G::dim>
void move(CellMoments<G>& moments, const CellMotion<D>& motion);

/// sum V_p sigma_p of the particles [first, last), as in the moments
template <class G, int D = G::dim>
Working<G> stress_sum(const Particles<D>& particles, Index first, Index last);

/// sum over particles of (scalar or vector) q_p N_k(x_p), from its zeroth and first moment
template <int D>
inline double at_vertex(double zeroth, const Vector<D>& first, const Vector<D>& gradient)
{
  return zeroth * (1.0 / (D + 1)) + dot<D>(first, gradient);
}
} // namespace mpm::transfer
