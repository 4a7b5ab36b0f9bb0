#include "boxes.h"
#include "transfer/nodal_mixed_discretisation.h"

#include <gtest/gtest.h>

#include <numeric>

using namespace mpm::transfer;

namespace
{
/// Filled volumes of the cells: between a half and the whole; some cells are empty, not the first.
template <int D>
std::vector<double> filled_volumes(const Mesh<D>& mesh, double empty_share)
{
  std::mt19937 random(8);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> volume;
  for (const auto& shape : mesh.shapes)
    volume.push_back(!volume.empty() && unit(random) < empty_share ? 0 : shape.volume * (0.5 + 0.5 * unit(random)));
  return volume;
}

template <int D>
std::vector<double> averaged(const Mesh<D>& mesh, const std::vector<double>& volume, std::vector<double> theta,
                             const AveragedGroups& groups = {})
{
  NodeExchange exchange; // one rank: nothing is shared
  std::vector<VolumeMean> nodes(mesh.points.size());
  const auto volume_of = [&](Index c) { return volume[c]; };
  const auto integral_of = [&](Index c, double filled) { return filled * theta[c]; };
  average_over_nodes(mesh, mpm::test::whole(mesh), groups, volume_of, integral_of, exchange, nodes);
  for (Index c = 0; c < mesh.n_cells(); ++c)
    if (volume[c] > 0)
      theta[c] = mean_of_vertices<D>(mesh, groups, c, nodes);
  return theta;
}
} // namespace

template <class T>
class MixedDiscretisationTest : public testing::Test
{
};
template <int N>
using Dimension = std::integral_constant<int, N>;
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(MixedDiscretisationTest, Dimensions);

TYPED_TEST(MixedDiscretisationTest, LeavesTheStrainOfALinearDisplacement)
{
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(4, 0.15).mesh();
  const auto volume = filled_volumes(mesh, 0.3);
  const auto theta = averaged(mesh, volume, std::vector<double>(volume.size(), 0.0123));
  for (double t : theta)
    EXPECT_NEAR(t, 0.0123, 1e-16);
}

TYPED_TEST(MixedDiscretisationTest, KeepsTheChangeOfVolume)
{
  // sum_c V_c mean_i theta_i = sum_i theta_i sum_c V_c / (D + 1) = sum_c V_c theta_c
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(4, 0.15).mesh();
  const auto volume = filled_volumes(mesh, 0.3);
  std::vector<double> theta;
  std::mt19937 random(9);
  for (std::size_t c = 0; c < volume.size(); ++c)
    theta.push_back(std::uniform_real_distribution<double>(-1, 1)(random));
  const auto after = averaged(mesh, volume, theta);
  const double kept = std::inner_product(volume.begin(), volume.end(), theta.begin(), 0.0);
  EXPECT_NEAR(std::inner_product(volume.begin(), volume.end(), after.begin(), 0.0), kept, 1e-14);
  EXPECT_NE(after[0], theta[0]);
}

TYPED_TEST(MixedDiscretisationTest, AveragesOverFilledCellsThatShareNodes)
{
  // Only cell 0 has strain: a node of it has theta_0 V_0 / sum V_c, and a cell the mean of its nodes.
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(2).mesh();
  const auto volume = filled_volumes(mesh, 0.2);
  ASSERT_GT(volume[0], 0);
  std::vector<double> theta(volume.size(), 0.0), at_node(mesh.points.size(), 0.0), around(mesh.points.size(), 0.0);
  theta[0] = 2;
  for (Index c = 0; c < mesh.n_cells(); ++c)
    for (Index node : mesh.cells[c])
      around[node] += volume[c];
  for (Index node : mesh.cells[0])
    at_node[node] = 2 * volume[0] / around[node];
  const auto after = averaged(mesh, volume, theta);
  for (Index c = 0; c < mesh.n_cells(); ++c)
  {
    double mean = 0;
    for (Index node : mesh.cells[c])
      mean += at_node[node] / (D + 1);
    if (volume[c] > 0)
    {
      EXPECT_NEAR(after[c], mean, 1e-15);
    }
  }
}

TYPED_TEST(MixedDiscretisationTest, AveragesGroupsApart)
{
  // Each group has the means that it has when the cells of the others are empty.
  constexpr int D = TypeParam::value;
  const Mesh<D> mesh = mpm::test::box<D>(4, 0.15).mesh();
  const auto volume = filled_volumes(mesh, 0.3);
  std::mt19937 random(10);
  std::vector<double> theta;
  AveragedGroups groups{3, {}};
  for (std::size_t c = 0; c < volume.size(); ++c)
  {
    theta.push_back(std::uniform_real_distribution<double>(-1, 1)(random));
    groups.of_cell.push_back(static_cast<Index>(random() % 3));
  }
  const auto apart = averaged(mesh, volume, theta, groups);
  for (int group = 0; group < groups.count; ++group)
  {
    auto own = volume;
    for (std::size_t c = 0; c < own.size(); ++c)
      own[c] *= groups.of_cell[c] == group;
    const auto alone = averaged(mesh, own, theta);
    for (std::size_t c = 0; c < own.size(); ++c)
      if (own[c] > 0)
      {
        EXPECT_EQ(apart[c], alone[c]);
      }
  }
}
