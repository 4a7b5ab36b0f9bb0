#include "boxes.h"
#include "mesh/search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

using namespace mpm::mesh;

namespace
{
template <int D>
Vector<D> random_point(std::mt19937& random)
{
  std::uniform_real_distribution<double> unit(0, 1);
  Vector<D> x;
  for (double& coordinate : x)
    coordinate = unit(random);
  return x;
}

template <int D>
bool holds(const Mesh<D>& mesh, Index cell, const Vector<D>& x)
{
  const auto n = shape_functions<D>(mesh.shapes[cell], x);
  return *std::min_element(n.begin(), n.end()) >= -inside_tolerance;
}
} // namespace

template <class T>
class MeshTest : public testing::Test
{
};
template <int N>
using Dimension = std::integral_constant<int, N>;
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(MeshTest, Dimensions);

TYPED_TEST(MeshTest, VolumesAddUpAndShapeFunctionsReproduceAffineFields)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(4, 0.2).mesh();
  double volume = 0;
  std::mt19937 random(3);
  for (Index c = 0; c < mesh.n_cells(); ++c)
  {
    volume += mesh.shapes[c].volume;
    const Vector<D> x = random_point<D>(random);
    const auto n = shape_functions<D>(mesh.shapes[c], x);
    double one = 0;
    Vector<D> there{};
    for (int k = 0; k <= D; ++k)
    {
      one += n[k];
      for (int i = 0; i < D; ++i)
        there[i] += n[k] * mesh.points[mesh.cells[c][k]][i];
    }
    EXPECT_NEAR(one, 1, 1e-13);
    for (int i = 0; i < D; ++i)
      EXPECT_NEAR(there[i], x[i], 1e-12); // affine everywhere, also outside of the cell
  }
  EXPECT_NEAR(volume, 1, 1e-13);
}

TYPED_TEST(MeshTest, NeighboursShareAFacet)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(3, 0.2).mesh();
  int boundary = 0;
  for (Index c = 0; c < mesh.n_cells(); ++c)
    for (int k = 0; k <= D; ++k)
    {
      const Index other = mesh.neighbours[c][k];
      EXPECT_EQ(other == none, mesh.facet_tags[c][k] != none); // the box tags its whole boundary
      boundary += other == none;
      if (other == none)
        continue;
      for (Index node : facet_nodes<D>(mesh.cells[c], k))
        EXPECT_THAT(mesh.cells[other], testing::Contains(node));
    }
  EXPECT_EQ(boundary, D == 2 ? 4 * 3 : 6 * 9 * 2);
}

TYPED_TEST(MeshTest, SearchFindsTheCellFromAnywhere)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = D == 2 ? mpm::test::box<D>(24, 0.3).mesh() : mpm::test::box<D>(8, 0.15).mesh();
  std::mt19937 random(5);
  std::uniform_int_distribution<Index> any_cell(0, mesh.n_cells() - 1);
  for (int n = 0; n < 2000; ++n)
  {
    const Vector<D> x = random_point<D>(random);
    const Location location = find_cell<D>(mesh, x, any_cell(random));
    ASSERT_NE(location.cell, none);
    EXPECT_TRUE(holds<D>(mesh, location.cell, x));
    const Index in_bins = find_cell_in_bins<D>(mesh, x);
    ASSERT_NE(in_bins, none);
    EXPECT_TRUE(holds<D>(mesh, in_bins, x));
  }
  Vector<D> outside{};
  outside[0] = 1.001;
  const Location location = find_cell<D>(mesh, outside, 0);
  EXPECT_EQ(location.cell, none);
  EXPECT_EQ(mesh.facet_tags[location.exit_cell][location.exit_facet], 2);
  outside[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(find_cell<D>(mesh, outside, 0).cell, none);
  EXPECT_EQ(find_cell_in_bins<D>(mesh, outside), none);
}

TEST(Mesh, SearchPassesAHole)
{
  // A square ring: the straight walk from left to right ends at the hole, the point is inside all the same.
  mpm::test::BoxArrays<2> arrays = mpm::test::box<2>(6);
  std::vector<Index> kept;
  for (std::size_t c = 0; c < arrays.cells.size() / 3; ++c)
  {
    Vector<2> centre{};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 2; ++i)
        centre[i] += arrays.points[arrays.cells[3 * c + k] * 2 + i] / 3;
    if (std::max(std::abs(centre[0] - 0.5), std::abs(centre[1] - 0.5)) > 0.34)
      kept.insert(kept.end(), &arrays.cells[3 * c], &arrays.cells[3 * c] + 3);
  }
  arrays.cells = kept;
  const Mesh<2> mesh = arrays.mesh();
  const Index left = find_cell_in_bins<2>(mesh, {0.05, 0.5});
  const Location right = find_cell<2>(mesh, {0.95, 0.52}, left);
  ASSERT_NE(right.cell, none);
  EXPECT_TRUE(holds<2>(mesh, right.cell, {0.95, 0.52}));
  EXPECT_EQ(find_cell<2>(mesh, {0.5, 0.5}, left).cell, none);
}

TEST(Mesh, RefusesBadInput)
{
  auto message = [](const MeshInput<2>& input)
  {
    try
    {
      make_mesh<2>(input, 0);
    }
    catch (const InputError& error)
    {
      return std::string(error.what());
    }
    return std::string("no error");
  };
  const std::vector<double> points{0, 0, 1, 0, 0, 1, 1, 1, 0.5, 0};
  EXPECT_THAT(message({points, std::vector<Index>{0, 1, 4}, {}, {}, {}, {}, {}, {}}), testing::HasSubstr("positive"));
  EXPECT_THAT(message({points, std::vector<Index>{0, 1, 7}, {}, {}, {}, {}, {}, {}}), testing::HasSubstr("node 7"));
  EXPECT_THAT(message({points, std::vector<Index>{0, 1, 2, 1, 2, 0}, {}, {}, {}, {}, {}, {}}),
              testing::HasSubstr("overlap"));
  const std::vector<double> folded{0, 0, 1, 0, 0, 1, 0.2, 0.2};
  EXPECT_THAT(message({folded, std::vector<Index>{0, 1, 2, 1, 2, 3}, {}, {}, {}, {}, {}, {}}),
              testing::HasSubstr("inverted"));
  const std::vector<Index> one{0, 1, 2}, facet{1, 3}, tag{5};
  EXPECT_THAT(message({points, one, {}, facet, tag, {}, {}, {}}), testing::HasSubstr("not a facet"));
  const std::vector<double> broken{0, 0, 1, std::nan(""), 0, 1};
  EXPECT_THAT(message({broken, one, {}, {}, {}, {}, {}, {}}), testing::HasSubstr("node 1 is nan"));
}
