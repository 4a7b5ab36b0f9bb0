#include "transfer/moments.h"

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

template <class G, int D>
void add_moments(const Particles<D>& particles, Index first, Index last, const CellShape<D>& shape,
                 CellMoments<G>& moments)
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

  if (last - first < lanes) // such as a particle that has changed cells; vectors would not be filled
  {
    for (Index p = first; p < last; ++p)
      add_particle<G>(particles, p, shape, moments);
    return;
  }
  constexpr std::size_t members = sizeof(CellMoments<G>) / sizeof(double);
  struct Sums // as the moments, lane by lane
  {
    Lanes volume, mass;
    std::array<Lanes, D> mass_xi;
    std::array<Lanes, n_symmetric<D>> mass_xixi;
    std::array<Lanes, D> momentum;
    std::array<std::array<Lanes, D>, D> momentum_xi;
    std::array<Lanes, S> stress;
  } sums{};
  const auto add = [&sums, centre = shape.centre](const Piece<2 * D + S + 2>& piece, const LaneMask& mine)
  {
    const Lanes mass = mine ? piece[2 * D + S] : Lanes{}, volume = mine ? piece[2 * D + S + 1] : Lanes{};
    std::array<Lanes, D> xi, mass_xi;
    sums.volume += volume;
    sums.mass += mass;
    for (int i = 0; i < D; ++i)
    {
      xi[i] = piece[i] - centre[i];
      mass_xi[i] = mass * xi[i];
      sums.mass_xi[i] += mass_xi[i];
    }
    for (int k = 0; k < n_symmetric<D>; ++k)
      sums.mass_xixi[k] += mass_xi[symmetric_pairs<D>[k][0]] * xi[symmetric_pairs<D>[k][1]];
    for (int k = 0; k < S; ++k)
      sums.stress[k] += volume * piece[2 * D + k];
    for (int a = 0; a < D; ++a)
    {
      sums.momentum[a] += mass * piece[D + a];
      for (int b = 0; b < D; ++b)
        sums.momentum_xi[a][b] += mass_xi[b] * piece[D + a];
    }
  };
  add_lanes(columns, first, last, add);
  const auto by_lane = std::bit_cast<std::array<Lanes, members>>(sums);
  auto numbers = std::bit_cast<std::array<double, members>>(moments);
  for (std::size_t k = 0; k < members; ++k)
    numbers[k] += sum(by_lane[k]);
  moments = std::bit_cast<CellMoments<G>>(numbers);
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
  template void move(CellMoments<G>&, const CellMotion<G::dim>&);                                                      \
  template Working<G> stress_sum<G>(const Particles<G::dim>&, Index, Index);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
template void add_moments(const Particles<2>&, Index, Index, const CellShape<2>&, TractionMoments<2>&);
template void add_moments(const Particles<3>&, Index, Index, const CellShape<3>&, TractionMoments<3>&);
} // namespace mpm::transfer
