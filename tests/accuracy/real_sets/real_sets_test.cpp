// Real photographs are posed on the visual hull of others of the same set.
#include <gtest/gtest.h>

#include "tests/accuracy/real_sets/hull_trial.h"

namespace scan::test {
namespace {

const std::filesystem::path kData = std::string(SCAN_SOURCE_DIR) + "/../shared/data";

// Every view counts, accepted or not.
void ExpectWithinBars(const HullFigures& figures) {
  EXPECT_LT(figures.calibrated.contour_px.median, 1.5);
  EXPECT_LT(SpreadOf(figures.rotation_deg).max, 3);
}

TEST(RealSets, TheDinosaurIsPosedWithoutLoggedPoses) {
  const auto set = LoadDino(kData / "middlebury_dino");
  if (!set) GTEST_SKIP() << "the data folder is not here";
  const auto trial = RunHullTrial(*set, {.hull_of_all = false, .most_posed = 4});
  ASSERT_TRUE(trial) << ToString(trial.error());
  const auto figures = FiguresOf(*trial);
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_EQ(figures->rotation_deg.size(), 4U);
  EXPECT_GE(figures->accepted, 3U);
  ExpectWithinBars(*figures);
}

TEST(RealSets, TheAppleIsPosedWithItsBoardAngles) {
  const auto set = LoadApple(kData / "apple_aruco_board", {});
  if (!set) GTEST_SKIP() << "the data folder is not here";
  const auto trial = RunHullTrial(*set, {.hull_of_all = false, .most_posed = 6});
  ASSERT_TRUE(trial) << ToString(trial.error());
  const auto figures = FiguresOf(*trial);
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_EQ(figures->rotation_deg.size(), 6U);
  EXPECT_EQ(figures->accepted, 6U);
  ExpectWithinBars(*figures);
}

}  // namespace
}  // namespace scan::test
