/// The bracketed root that laws find their plastic strain by.

#include "materials/tools/root.h"

#include <gtest/gtest.h>

using namespace mpm::materials;

namespace
{
template <class F>
double root_of(F&& f, double a, double b, int& evaluations)
{
  evaluations = 0;
  const auto counted = [&](double x)
  {
    ++evaluations;
    return f(x);
  };
  return root_between(counted, {a, f(a)}, {b, f(b)});
}
} // namespace

TEST(Root, IsFoundToRoundOff)
{
  int evaluations;
  EXPECT_NEAR(root_of([](double x) { return x * x - 2; }, 0, 2, evaluations), std::sqrt(2.0), 1e-15);
  EXPECT_LT(evaluations, 15);
  EXPECT_NEAR(root_of([](double x) { return std::exp(-1e6 * x) - 0.5; }, 0, 1, evaluations), std::log(2.0) * 1e-6,
              1e-20);
  EXPECT_LT(evaluations, 60);
}

// A jump has no root, but a place where the sign changes; the search ends there.
TEST(Root, EndsAtAJump)
{
  int evaluations;
  EXPECT_NEAR(root_of([](double x) { return x < 0.3 ? 1.0 : -1.0; }, 0, 1, evaluations), 0.3, 1e-15);
  EXPECT_LT(evaluations, 100);
}

TEST(Root, MayLieAtAnEnd)
{
  int evaluations;
  EXPECT_EQ(root_of([](double x) { return 1 - x; }, 0, 1, evaluations), 1.0);
}
