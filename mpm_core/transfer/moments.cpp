#include "transfer/moments.h"

#include "base/lanes.h"
#include "parallel/rounded_sums.h"
#include "transfer/affine_field.h"

namespace mpm::transfer
{
namespace
{
template <class G, int D = G::dim>
void add_particle(const Particles<D>& particles, Index p, const CellShape<D>& shape, CellMoments<G>& moments)
{
  const double mass = particles.mass[p], volume = particles.volume[p];
  Vector<D> xi, mass_xi;
  for (int i = 0; i < D; ++i)
  {
    xi[i] = particles.position[i][p] - shape.centre[i];
    mass_xi[i] = mass * xi[i];
    moments.mass_xi[i] += mass_xi[i];
  }
  moments.volume += volume;
  moments.mass += mass;
  for (int k = 0; k < n_symmetric<D>; ++k)
    moments.mass_xixi[k] += mass_xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
  for (int k = 0; k < G::n_working; ++k)
    moments.stress[k] += volume * particles.stress[working_component<G>[k]][p];
  for (int a = 0; a < D; ++a)
  {
    const double velocity = particles.velocity[a][p];
    moments.momentum[a] += mass * velocity;
    for (int b = 0; b < D; ++b)
      moments.momentum_xi[a][b] += mass_xi[b] * velocity;
  }
}
} // namespace

namespace
{
template <class G>
constexpr std::size_t n_members = sizeof(CellMoments<G>) / sizeof(double);

/// What some particles add to the moments, in the order of these.
template <class G>
using Terms = std::array<Lanes, n_members<G>>;

/// @param piece  positions, velocities, stresses, mass and volume
template <class G, int D = G::dim>
inline Terms<G> terms_of(const Piece<2 * D + G::n_working + 2>& piece, const LaneMask& mine, const Vector<D>& centre)
{
  constexpr int S = G::n_working;
  struct // as the moments, lane by lane
  {
    Lanes volume, mass;
    std::array<Lanes, D> mass_xi;
    std::array<Lanes, n_symmetric<D>> mass_xixi;
    std::array<Lanes, D> momentum;
    std::array<std::array<Lanes, D>, D> momentum_xi;
    std::array<Lanes, S> stress;
  } terms;
  terms.mass = mine ? piece[2 * D + S] : Lanes{};
  terms.volume = mine ? piece[2 * D + S + 1] : Lanes{};
  std::array<Lanes, D> xi;
  for (int i = 0; i < D; ++i)
  {
    xi[i] = piece[i] - centre[i];
    terms.mass_xi[i] = terms.mass * xi[i];
  }
  for (int k = 0; k < n_symmetric<D>; ++k)
    terms.mass_xixi[k] = terms.mass_xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
  for (int k = 0; k < S; ++k)
    terms.stress[k] = terms.volume * piece[2 * D + k];
  for (int a = 0; a < D; ++a)
  {
    terms.momentum[a] = terms.mass * piece[D + a];
    for (int b = 0; b < D; ++b)
      terms.momentum_xi[a][b] = terms.mass_xi[b] * piece[D + a];
  }
  return std::bit_cast<Terms<G>>(terms);
}

/// Calls `take` with the terms of the particles [first, last), some at a time.
template <class G, class Take, int D = G::dim>
inline void each_terms(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape, Take&& take)
{
  constexpr int S = G::n_working;
  std::array<const double*, 2 * D + S + 2> columns;
  for (int i = 0; i < D; ++i)
  {
    columns[i] = particles.position[i].data();
    columns[D + i] = particles.velocity[i].data();
  }
  for (int k = 0; k < S; ++k)
    columns[2 * D + k] = particles.stress[working_component<G>[k]].data();
  columns[2 * D + S] = particles.mass.data();
  columns[2 * D + S + 1] = particles.volume.data();
  add_lanes(columns, first, last,
            [&take, centre = shape.centre](const Piece<2 * D + S + 2>& piece, const LaneMask& mine)
            { take(terms_of<G, D>(piece, mine, centre)); });
}

/// Changes the numbers of moments one by one; `change` is a callable (std::size_t k, double& number).
template <class G, class Change>
inline void each_number(CellMoments<G>& moments, Change&& change)
{
  auto numbers = std::bit_cast<std::array<double, n_members<G>>>(moments);
  for (std::size_t k = 0; k < numbers.size(); ++k)
    change(k, numbers[k]);
  moments = std::bit_cast<CellMoments<G>>(numbers);
}
} // namespace

template <class G, int D>
void add_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                 CellMoments<G>& moments)
{
  if (last - first < lanes) // such as a particle that has changed cells; vectors would not be filled
  {
    for (Index p = first; p < last; ++p)
      add_particle<G>(particles, p, shape, moments);
    return;
  }
  Terms<G> sums{};
  each_terms<G>(particles, first, last, shape,
                [&sums](const Terms<G>& terms)
                {
                  for (std::size_t k = 0; k < sums.size(); ++k)
                    sums[k] += terms[k];
                });
  each_number(moments, [&sums](std::size_t k, double& number) { number += sum(sums[k]); });
}

template <class G, int D>
void keep_largest_terms(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                        CellMoments<G>& largest)
{
  Terms<G> most{};
  each_terms<G>(particles, first, last, shape,
                [&most](const Terms<G>& terms)
                {
                  for (std::size_t k = 0; k < most.size(); ++k)
                  {
                    const Lanes size = terms[k] < 0 ? -terms[k] : terms[k];
                    most[k] = size <= most[k] ? most[k] : size; // so that NaN is kept
                  }
                });
  const auto keep = [&most](std::size_t k, double& number)
  {
    for (int l = 0; l < lanes; ++l)
      number = most[k][l] <= number ? number : most[k][l];
  };
  each_number(largest, keep);
}

template <class G, int D>
void add_rounded_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                         const CellMoments<G>& largest, CellMoments<G>& moments)
{
  const auto bounds = std::bit_cast<std::array<double, n_members<G>>>(largest);
  std::array<double, n_members<G>> by;
  for (std::size_t k = 0; k < by.size(); ++k)
    by[k] = rounding(bounds[k]);
  Terms<G> sums{};
  each_terms<G>(particles, first, last, shape,
                [&sums, &by](const Terms<G>& terms)
                {
                  for (std::size_t k = 0; k < sums.size(); ++k)
                    sums[k] += (terms[k] + by[k]) - by[k];
                });
  each_number(moments, [&sums](std::size_t k, double& number) { number += sum(sums[k]); });
}

template <int D>
void add_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                 TractionMoments<D>& moments)
{
  for (Index p = first; p < last; ++p)
    for (int a = 0; a < D; ++a)
    {
      const double t = particles.traction[a][p];
      moments.force[a] += t;
      for (int b = 0; b < D; ++b)
        moments.force_xi[a][b] += t * (particles.position[b][p] - shape.centre[b]);
    }
}

template <class G, int D>
void move(CellMoments<G>& moments, const CellMotion<D>& motion)
{
  // xi becomes A xi + u with A = 1 + grad u; first the velocities at the old places, then the places. All in vectors of
  // components: twice as fast in plane strain as the compiler's own choice of vectors, which goes through memory.
  using Row = Components<D>;
  const double mass = moments.mass;
  const Vector<D>& centre = moments.mass_xi;
  const Row xi = components<D>(centre), u = components<D>(motion.displacement.value);
  const Matrix<D>& by = motion.displacement.gradient;
  std::array<Row, D> xixi, A; // rows of the symmetric one, columns of the other
  for (int j = 0; j < D; ++j)
  {
    Vector<D> row, column;
    for (int i = 0; i < D; ++i)
    {
      row[i] = moments.mass_xixi[symmetric_index<D>(i, j)];
      column[i] = by[i][j] + (i == j);
    }
    xixi[j] = components<D>(row);
    A[j] = components<D>(column);
  }
  const auto turned = [&A](const auto& x)
  {
    Row y = A[0] * x[0];
    for (int i = 1; i < D; ++i)
      y += A[i] * x[i];
    return y;
  };
  Vector<D> momentum;
  std::array<Row, D> momentum_xi, second;
  for (int a = 0; a < D; ++a)
  {
    const double f = motion.change.value[a];
    const Vector<D>& df = motion.change.gradient[a];
    double value = motion.flip_fraction * moments.momentum[a] + mass * f;
    Row first = motion.flip_fraction * components<D>(moments.momentum_xi[a]) + f * xi;
    for (int b = 0; b < D; ++b)
    {
      value += df[b] * centre[b];
      first += df[b] * xixi[b];
    }
    momentum[a] = value;
    momentum_xi[a] = turned(first) + value * u;
  }
  const Row centre_turned = turned(centre), end = centre_turned + mass * u;
  for (int i = 0; i < D; ++i)
  {
    Row half = xixi[i]; // of A sum m_p xi (x) xi
    for (int j = 0; j < D; ++j)
      half += by[i][j] * xixi[j];
    second[i] = turned(half) + centre_turned[i] * u + motion.displacement.value[i] * end;
  }
  for (int a = 0; a < D; ++a)
  {
    moments.momentum[a] = momentum[a];
    moments.mass_xi[a] = end[a];
    for (int b = 0; b < D; ++b)
    {
      moments.momentum_xi[a][b] = momentum_xi[a][b];
      moments.mass_xixi[symmetric_index<D>(a, b)] = second[a][b];
    }
  }
}

template <class G, int D>
Working<G> stress_sum(const Particles<D>& particles, Index first, Index last)
{
  constexpr int S = G::n_working;
  std::array<const double*, S + 1> columns;
  for (int k = 0; k < S; ++k)
    columns[k] = particles.stress[working_component<G>[k]].data();
  columns[S] = particles.volume.data();
  Piece<S> sums;
  for (int k = 0; k < S; ++k) // one by one: an array set to zero at once goes through memory
    sums[k] = Lanes{};
  add_lanes(columns, first, last,
            [&sums](const Piece<S + 1>& piece, const LaneMask& mine)
            {
              const Lanes volume = mine ? piece[S] : Lanes{};
              for (int k = 0; k < S; ++k)
                sums[k] += volume * piece[k];
            });
  Working<G> result;
  for (int k = 0; k < S; ++k)
    result[k] = sum(sums[k]);
  return result;
}

#define INSTANTIATE(G)                                                                                                 \
  template void add_moments(const Particles<G::dim>&, Index, Index, const CellShape<G::dim>&, CellMoments<G>&);        \
  template void keep_largest_terms(const Particles<G::dim>&, Index, Index, const CellShape<G::dim>&, CellMoments<G>&); \
  template void add_rounded_moments(const Particles<G::dim>&, Index, Index, const CellShape<G::dim>&,                  \
                                    const CellMoments<G>&, CellMoments<G>&);                                           \
  template void move(CellMoments<G>&, const CellMotion<G::dim>&);                                                      \
  template Working<G> stress_sum<G>(const Particles<G::dim>&, Index, Index);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
template void add_moments(const Particles<2>&, Index, Index, const CellShape<2>&, TractionMoments<2>&);
template void add_moments(const Particles<3>&, Index, Index, const CellShape<3>&, TractionMoments<3>&);
} // namespace mpm::transfer
