#include "boxes.h"
#include "particles/particles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

using namespace mpm::particles;

namespace
{
/// Particles whose every value tells its particle and its column; in cells and of materials at random.
template <int D>
Particles<D> marked(Index size, Index n_cells, Index n_materials)
{
  Particles<D> particles;
  particles.state.resize(3);
  add_field(particles, {"shear_strength", "Pa", "Of undrained soil", 5e3, {}}, 2);
  resize(particles, size);
  for_each_field(particles,
                 [&](const Field&, auto& columns)
                 {
                   if constexpr (is_optional<std::remove_cvref_t<decltype(columns)>>)
                     require(columns, particles.id.size());
                 });
  double column_number = 0;
  for_each_column(particles,
                  [&](std::string_view, int, auto& column)
                  {
                    ++column_number;
                    for (std::size_t p = 0; p < column.size(); ++p)
                      column[p] = static_cast<std::decay_t<decltype(column[p])>>(1000 * column_number + p);
                  });
  std::mt19937 random(11);
  for (Index p = 0; p < size; ++p)
  {
    particles.id[p] = p;
    particles.cell[p] = static_cast<Index>(random() % n_cells);
    particles.material[p] = static_cast<Index>(random() % n_materials);
  }
  return particles;
}

/// Whether each row of `now` is the row of `before` with the same number, in every column.
template <int D>
bool rows_are_kept(Particles<D> before, Particles<D> now)
{
  std::vector<std::vector<double>> old_columns, new_columns;
  auto copy_to = [](auto& list)
  { return [&list](std::string_view, int, const auto& column) { list.emplace_back(column.begin(), column.end()); }; };
  for_each_column(before, copy_to(old_columns));
  for_each_column(now, copy_to(new_columns));
  for (std::size_t k = 0; k < new_columns.size(); ++k)
    for (Index p = 0; p < now.size(); ++p)
      if (new_columns[k].size() != now.id.size() || new_columns[k][p] != old_columns[k][now.id[p]])
        return false;
  return true;
}
} // namespace

template <class T>
class ParticlesTest : public testing::Test
{
};
template <int N>
using Dimension = std::integral_constant<int, N>;
using Dimensions = testing::Types<Dimension<2>, Dimension<3>>;
TYPED_TEST_SUITE(ParticlesTest, Dimensions);

TYPED_TEST(ParticlesTest, EveryColumnIsOnTheList)
{
  // The struct holds nothing but columns, a flag for each optional field and the list of added fields, so its size
  // counts them; the schedule visits each column once (state and added fields have none here).
  constexpr int D = TypeParam::value;
  Particles<D> particles;
  std::set<const void*> visited;
  for_each_column(particles, [&](std::string_view, int, auto& column) { visited.insert(&column); });
  std::size_t flags = 0;
  for_each_field(particles, [&](const Field&, const auto& columns)
                 { flags += is_optional<std::remove_cvref_t<decltype(columns)>>; });
  EXPECT_EQ((visited.size() + 2) * sizeof(Column) + flags * alignof(Column), sizeof(Particles<D>));
}

TYPED_TEST(ParticlesTest, SortingKeepsEveryRowWhole)
{
  constexpr int D = TypeParam::value;
  const Particles<D> before = marked<D>(500, 20, 3);
  Particles<D> sorted = before;
  sort_by_cell(sorted, 20, 3);
  EXPECT_TRUE(rows_are_kept(before, sorted));
  for (Index p = 1; p < sorted.size(); ++p)
  {
    const auto key = [&](Index q) { return std::tuple(sorted.cell[q], sorted.material[q], sorted.id[q]); };
    EXPECT_LT(key(p - 1), key(p)); // stable: within a cell and material the order stays
  }
}

TYPED_TEST(ParticlesTest, SortingLeavesOptionalColumnsEmpty)
{
  constexpr int D = TypeParam::value;
  Particles<D> particles = marked<D>(50, 5, 1);
  particles.traction = {};
  sort_by_cell(particles, 5, 1);
  resize(particles, 60);
  for (const auto& column : particles.traction.columns)
    EXPECT_TRUE(column.empty());
  require(particles.traction, particles.id.size());
  for (const auto& column : particles.traction.columns)
    EXPECT_EQ(column, Column(60, 0.0));
}

TYPED_TEST(ParticlesTest, AddedFieldsBeginWithTheirInitialValue)
{
  constexpr int D = TypeParam::value;
  Particles<D> particles;
  resize(particles, 3);
  add_field(particles, {"strength", "Pa", "", 7.0, {}}, 1);
  resize(particles, 5);
  EXPECT_EQ(particles.added[0].columns[0], Column(5, 7.0));
  EXPECT_EQ(empty_like(particles).added[0].columns.size(), 1);
  EXPECT_EQ(empty_like(particles).size(), 0);
  for (const char* name : {"strength", "volume", "", "a b"})
    EXPECT_THROW(add_field(particles, {name, "", "", 0, {}}, 1), InputError);
  EXPECT_THROW(add_field(particles, {"other", "", "", 0, {}}, 0), InputError);
}

TYPED_TEST(ParticlesTest, RemovingKeepsTheOthersWhole)
{
  constexpr int D = TypeParam::value;
  const Particles<D> before = marked<D>(100, 7, 2);
  const std::vector<Index> gone{0, 1, 17, 50, 98, 99};
  Particles<D> kept = before;
  remove<D>(kept, gone);
  EXPECT_EQ(kept.size(), 94);
  EXPECT_TRUE(rows_are_kept(before, kept));
  std::set<GlobalIndex> ids(kept.id.begin(), kept.id.end());
  EXPECT_EQ(ids.size(), 94u);
  for (Index p : gone)
    EXPECT_FALSE(ids.contains(p));
}

TYPED_TEST(ParticlesTest, RunsCoverAllParticlesAndStayInOneCellAndMaterial)
{
  constexpr int D = TypeParam::value;
  Particles<D> particles = marked<D>(400, 9, 2);
  particles.resting = {};
  sort_by_cell(particles, 9, 2);
  std::vector<Run> runs;
  find_runs(particles, 16, runs);
  Index next = 0;
  for (const Run& run : runs)
  {
    EXPECT_EQ(run.first, next);
    EXPECT_LE(run.last - run.first, 16);
    for (Index p = run.first; p < run.last; ++p)
      EXPECT_TRUE(particles.cell[p] == run.cell && particles.material[p] == run.material);
    next = run.last;
  }
  EXPECT_EQ(next, particles.size());
  find_runs(particles, 400, runs);
  EXPECT_EQ(runs.size(), 18u); // one per cell and material, all of which occur
}

TYPED_TEST(ParticlesTest, TheRowOfARestingCellIsARun)
{
  constexpr int D = TypeParam::value;
  Particles<D> particles = marked<D>(90, 9, 1);
  for (Index p = 0; p < 90; ++p)
  {
    particles.cell[p] = p % 9;
    particles.resting[0][p] = p == 4 || p == 13 || p == 40; // three rows of cell 4, of ten there
  }
  sort_by_cell(particles, 9, 1);
  std::vector<Run> runs;
  find_runs(particles, 400, runs);
  for (const Run& run : runs)
  {
    EXPECT_TRUE(!run.resting || run.last - run.first == 1);
    for (Index p = run.first; p < run.last; ++p)
      EXPECT_EQ(run.resting, is_resting(particles, p));
  }
  EXPECT_EQ(std::ranges::count_if(runs, &Run::resting), 3);
}

TYPED_TEST(ParticlesTest, RunsFoundAgainAreThoseFoundAnew)
{
  // Particles of some runs go to other cells, among them to that of the run before; long runs are cut.
  constexpr int D = TypeParam::value;
  Particles<D> particles = marked<D>(400, 9, 2);
  particles.resting = {};
  sort_by_cell(particles, 9, 2);
  std::vector<Run> again, anew;
  find_runs(particles, 16, again);
  std::mt19937 random(4);
  for (int round = 0; round < 20; ++round)
  {
    for (Run& run : again)
      run.out_of_order = random() % 4 == 0;
    for (const Run& run : again)
      if (run.out_of_order)
        for (Index p = run.first; p < run.last; p += 1 + static_cast<Index>(random() % 5))
          particles.cell[p] = static_cast<Index>(random() % 9);
    find_runs_again(particles, 16, again);
    find_runs(particles, 16, anew);
    ASSERT_EQ(again.size(), anew.size());
    for (std::size_t r = 0; r < anew.size(); ++r)
      EXPECT_TRUE(again[r].first == anew[r].first && again[r].last == anew[r].last && again[r].cell == anew[r].cell &&
                  again[r].material == anew[r].material && !again[r].out_of_order);
  }
}

TYPED_TEST(ParticlesTest, BytesPerParticleCountTheColumns)
{
  // 8 bytes: id, 3 D (position, velocity, initial position) + D (traction), stress, volume, mass, strain, 3 states, 2
  // of the added field, 1 + D + 2 D^2 of resting cells, 5 + 2 D + D^2 of water; 4: two
  constexpr int D = TypeParam::value;
  EXPECT_EQ(bytes_per_particle(marked<D>(10, 2, 1)), 8 * (6 + 7 * D + 3 * D * D + n_stress<D> + 3 + 4 + 2) + 2 * 4);
}
