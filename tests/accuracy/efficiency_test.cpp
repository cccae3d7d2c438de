#include "tests/accuracy/efficiency.h"

#include <gtest/gtest.h>

#include "reconstruction/specimens/specimen.h"

namespace scan::test {
namespace {

const EfficiencyBench& Bench() {
  static const EfficiencyBench bench = [] {
    const auto beetle = MakeSpecimen("beetle");
    EXPECT_TRUE(beetle);
    Fig12Options fig12;
    fig12.cameras = 16;
    fig12.w = 924;
    fig12.h = 612;
    return EfficiencyBench(ExactSurface(**beetle, 0.35), fig12);
  }();
  return bench;
}

// Sixteen views tell the ratio to about a tenth; docs/results.md has more. A ratio well below
// one would mean that the bound is wrong.
TEST(Efficiency, SubPixelOutlinesAreUsedNearlyInFull) {
  const auto e = Bench().Measure({.sigma_px = 0.5}, 0.02);
  ASSERT_TRUE(e) << ToString(e.error());
  EXPECT_EQ(e->accepted, e->views);
  EXPECT_LT(e->skipped, 0.1);
  EXPECT_GT(e->centre_ratio, 0.8);
  EXPECT_LT(e->centre_ratio, 1.3);
  EXPECT_GT(e->surface_ratio, 0.8);
  EXPECT_LT(e->surface_ratio, 1.3);
  EXPECT_GT(e->mean_nees, 4);
  EXPECT_LT(e->mean_nees, 9);
}

TEST(Efficiency, AFreeMaskBiasCostsNoMoreThanItMust) {
  const auto e = Bench().Measure({.sigma_px = 0.5, .bias_px = 0.7}, 1);
  ASSERT_TRUE(e) << ToString(e.error());
  EXPECT_EQ(e->accepted, e->views);
  EXPECT_LT(e->surface_ratio, 1.3);
  EXPECT_GT(e->surface_ratio, 0.8);
}

}  // namespace
}  // namespace scan::test
