// Real photographs are posed on the visual hull of others of the same set.
#include <gtest/gtest.h>

#include "tests/accuracy/real_sets/hull_trial.h"

namespace scan::test {
namespace {

const std::filesystem::path kData = std::string(SCAN_SOURCE_DIR) + "/../shared/data";

// Every posed view counts, accepted or not.
void ExpectPosed(const RealSet& set, std::size_t views, std::size_t least_accepted) {
  const auto trial = RunHullTrial(set, {.hull_of_all = false, .most_posed = views});
  ASSERT_TRUE(trial) << ToString(trial.error());
  const auto figures = FiguresOf(*trial);
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_EQ(figures->rotation_deg.size(), views);
  EXPECT_GE(figures->accepted, least_accepted);
  EXPECT_LT(figures->calibrated.contour.px.median, 1.5);
  EXPECT_LT(SpreadOf(figures->rotation_deg).max, 3);
}

TEST(RealSets, TheDinosaurIsPosedWithoutLoggedPoses) {
  const auto set = LoadDino(kData / "middlebury_dino");
  if (!set) GTEST_SKIP() << "the data folder is not here";
  ExpectPosed(*set, 4, 3);
}

TEST(RealSets, TheAppleIsPosedWithItsBoardAngles) {
  const auto set = LoadApple(kData / "apple_aruco_board", {});
  if (!set) GTEST_SKIP() << "the data folder is not here";
  ExpectPosed(*set, 6, 6);
}

}  // namespace
}  // namespace scan::test
