#include "particles/seed.h"

#include "base/number_text.h"
#include "mesh/search.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace mpm::particles
{
namespace
{
template <int D>
using Barycentric = std::array<double, D + 1>;

int lattice_size(int dimension, int k) { return dimension == 2 ? k * (k + 1) / 2 : k * (k + 1) * (k + 2) / 6; }

/// Points (i + a, j + a, ...) / (k - 1 + (D+1) a) with i + j + ... = k - 1. With a = 1/(D+1) the outermost layer stands
/// off the faces by as much as a point of equal volume should.
template <int D>
void add_lattice(int k, int left, int depth, std::array<int, D + 1>& numbers, std::vector<Barycentric<D>>& points)
{
  if (depth == D)
  {
    numbers[D] = left;
    const double a = 1.0 / (D + 1);
    Barycentric<D> point;
    for (int i = 0; i <= D; ++i)
      point[i] = (numbers[i] + a) / (k - 1 + (D + 1) * a);
    points.push_back(point);
    return;
  }
  for (int i = 0; i <= left; ++i)
  {
    numbers[depth] = i;
    add_lattice<D>(k, left - i, depth + 1, numbers, points);
  }
}

/// The cell cut into 2^D cells of equal volume by its mid-edges: the corners, then the octahedron's four or the middle
/// one.
template <int D>
std::vector<std::array<Barycentric<D>, D + 1>> children(const std::array<Barycentric<D>, D + 1>& v)
{
  auto mid = [&v](int i, int j)
  {
    Barycentric<D> m;
    for (int c = 0; c <= D; ++c)
      m[c] = 0.5 * (v[i][c] + v[j][c]);
    return m;
  };
  if constexpr (D == 2)
    return {{v[0], mid(0, 1), mid(0, 2)},
            {mid(0, 1), v[1], mid(1, 2)},
            {mid(0, 2), mid(1, 2), v[2]},
            {mid(0, 1), mid(1, 2), mid(0, 2)}};
  else
    return {{v[0], mid(0, 1), mid(0, 2), mid(0, 3)},      {mid(0, 1), v[1], mid(1, 2), mid(1, 3)},
            {mid(0, 2), mid(1, 2), v[2], mid(2, 3)},      {mid(0, 3), mid(1, 3), mid(2, 3), v[3]},
            {mid(0, 1), mid(0, 2), mid(0, 3), mid(1, 3)}, {mid(0, 1), mid(0, 2), mid(1, 2), mid(1, 3)},
            {mid(0, 2), mid(0, 3), mid(1, 3), mid(2, 3)}, {mid(0, 2), mid(1, 2), mid(1, 3), mid(2, 3)}};
}

/// Lattice number k and number of divisions s for a count, the fewest divisions first.
template <int D>
std::optional<std::pair<int, int>> arrangement(int count)
{
  for (int s = 0, parts = 1; parts <= count; ++s, parts *= 1 << D)
    if (count % parts == 0)
      for (int k = 1; lattice_size(D, k) * parts <= count; ++k)
        if (lattice_size(D, k) * parts == count)
          return std::pair{k, s};
  return std::nullopt;
}

template <int D>
void check_soil(const SeedMaterial& soil)
{
  if (!(soil.density > 0 && std::isfinite(soil.density)))
    throw InputError("density is " + number_text(soil.density) + " kg/m3, expected a positive number");
}

template <int D>
void set_particle(Particles<D>& particles, Index p, GlobalIndex id, const Vector<D>& x, Index cell, double volume,
                  const SeedMaterial& soil)
{
  particles.id[p] = id;
  for (int i = 0; i < D; ++i)
    particles.position[i][p] = particles.initial_position[i][p] = x[i];
  particles.volume[p] = volume;
  particles.mass[p] = volume * soil.density;
  particles.material[p] = soil.material;
  particles.cell[p] = cell;
}
} // namespace

template <int D>
std::vector<std::array<double, D + 1>> even_points(int count)
{
  const auto found = count > 0 ? arrangement<D>(count) : std::nullopt;
  if (!found)
  {
    std::string near;
    for (int n = std::max(1, count - 12), shown = 0; n <= std::max(1, count) + 12 && shown < 6; ++n)
      if (arrangement<D>(n))
      {
        near += (shown++ ? ", " : "") + std::to_string(n);
      }
    throw InputError("per_cell is " + std::to_string(count) + ", expected a number of particles that fills a " +
                     (D == 2 ? "triangle" : "tetrahedron") + " evenly, near it: " + near);
  }
  const auto [k, divisions] = *found;
  std::vector<Barycentric<D>> lattice;
  std::array<int, D + 1> numbers{};
  add_lattice<D>(k, k - 1, 0, numbers, lattice);

  std::array<Barycentric<D>, D + 1> whole{};
  for (int i = 0; i <= D; ++i)
    whole[i][i] = 1;
  std::vector<std::array<Barycentric<D>, D + 1>> parts{whole};
  for (int s = 0; s < divisions; ++s)
  {
    std::vector<std::array<Barycentric<D>, D + 1>> finer;
    for (const auto& part : parts)
      for (const auto& child : children<D>(part))
        finer.push_back(child);
    parts = std::move(finer);
  }
  std::vector<Barycentric<D>> points;
  for (const auto& part : parts)
    for (const auto& l : lattice)
    {
      Barycentric<D> point{};
      for (int i = 0; i <= D; ++i)
        for (int c = 0; c <= D; ++c)
          point[c] += l[i] * part[i][c];
      points.push_back(point);
    }
  return points;
}

template <class G, int D>
Index seed_cells(const Mesh<D>& mesh, std::optional<Index> tag, int per_cell, SeedMaterial soil, GlobalIndex first_id,
                 Particles<D>& particles)
{
  const auto points = even_points<D>(per_cell);
  check_soil<D>(soil);
  std::vector<Index> cells;
  for (Index c = 0; c < mesh.owned_cells; ++c)
    if (!tag || mesh.cell_tags[c] == *tag)
      cells.push_back(c);
  Index p = particles.size();
  resize(particles, p + static_cast<Index>(cells.size()) * per_cell);
  for (Index c : cells)
    for (int k = 0; k < per_cell; ++k, ++p)
    {
      const Vector<D> x = point_in_cell<D>(mesh, c, points[static_cast<std::size_t>(k)]);
      set_particle<D>(particles, p, first_id + mesh.global_cells[c] * per_cell + k, x, c,
                      thickness<G>(x) * mesh.shapes[c].volume / per_cell, soil);
    }
  return static_cast<Index>(cells.size()) * per_cell;
}

template <int D>
Index seed_points(const Mesh<D>& mesh, std::span<const double> points, std::span<const double> volumes,
                  std::span<const GlobalIndex> ids, SeedMaterial soil, Particles<D>& particles)
{
  check_soil<D>(soil);
  Index added = 0;
  for (std::size_t n = 0; n < volumes.size(); ++n)
  {
    Vector<D> x;
    std::copy_n(&points[n * D], D, x.begin());
    const Index cell = find_cell_in_bins<D>(mesh, x);
    if (cell == none || cell >= mesh.owned_cells)
      continue;
    const Index p = particles.size();
    resize(particles, p + 1);
    set_particle<D>(particles, p, ids[n], x, cell, volumes[n], soil);
    ++added;
  }
  return added;
}

template <class G>
double load_facets(const Mesh<G::dim>& mesh, Index facet_tag, const Vector<G::dim>& traction,
                   Particles<G::dim>& particles)
{
  constexpr int D = G::dim;
  require(particles.traction,
          particles.id.size()); // on ranks without such facets, too, so that all have the same columns
  std::vector<std::vector<Index>> of_cell(static_cast<std::size_t>(mesh.owned_cells));
  for (Index p = 0; p < particles.size(); ++p)
    of_cell[static_cast<std::size_t>(particles.cell[p])].push_back(p);
  for (Index p = 0; p < particles.size(); ++p)
    if (is_resting(particles, p) &&
        std::ranges::count(mesh.facet_tags[static_cast<std::size_t>(particles.cell[p])], facet_tag) > 0)
      throw InputError("facet_tag has facets of resting cells, expected particles behind all of them");
  double total = 0;
  for (Index c = 0; c < mesh.owned_cells; ++c)
    for (int k = 0; k <= D; ++k)
    {
      const auto& inside = of_cell[static_cast<std::size_t>(c)];
      if (mesh.facet_tags[c][k] != facet_tag || inside.empty())
        continue;
      // The shape function of the opposite vertex measures the distance from the facet.
      std::vector<double> distance;
      for (Index p : inside)
        distance.push_back(shape_functions<D>(mesh.shapes[c], at<D>(particles.position, p))[k]);
      const double nearest = *std::min_element(distance.begin(), distance.end());
      Vector<D> middle{};
      for (Index node : facet_nodes<D>(mesh.cells[c], k))
        for (int i = 0; i < D; ++i)
          middle[i] += mesh.points[node][i] / D;
      const double area = thickness<G>(middle) * D * mesh.shapes[c].volume * norm<D>(mesh.shapes[c].gradient[k]);
      double weights = 0; // by the particles' own radius in axial symmetry
      for (std::size_t j = 0; j < inside.size(); ++j)
        if (distance[j] < nearest + 1e-6)
          weights += thickness<G>(at<D>(particles.position, inside[j]));
      for (std::size_t j = 0; j < inside.size(); ++j)
        if (distance[j] < nearest + 1e-6)
        {
          const double part = thickness<G>(at<D>(particles.position, inside[j])) / weights;
          for (int i = 0; i < D; ++i)
            particles.traction[i][inside[j]] += traction[i] * area * part;
        }
      total += area;
    }
  return total;
}

#define INSTANTIATE(G)                                                                                                 \
  template Index seed_cells<G>(const Mesh<G::dim>&, std::optional<Index>, int, SeedMaterial, GlobalIndex,              \
                               Particles<G::dim>&);                                                                    \
  template double load_facets<G>(const Mesh<G::dim>&, Index, const Vector<G::dim>&, Particles<G::dim>&);
INSTANTIATE(PlaneStrain)
INSTANTIATE(Axisymmetric)
INSTANTIATE(Solid)
#undef INSTANTIATE
#define INSTANTIATE(D)                                                                                                 \
  template std::vector<std::array<double, D + 1>> even_points<D>(int);                                                 \
  template Index seed_points(const Mesh<D>&, std::span<const double>, std::span<const double>,                         \
                             std::span<const GlobalIndex>, SeedMaterial, Particles<D>&);
INSTANTIATE(2)
INSTANTIATE(3)
} // namespace mpm::particles
