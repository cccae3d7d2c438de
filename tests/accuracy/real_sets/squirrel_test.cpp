// Real photographs with nominal poses only: principal point 3.3 px off, axis tilted by 1.72
// degrees. The bars are those that such a station is held to.
#include <gtest/gtest.h>

#include "reconstruction/evaluate/calibrated.h"
#include "reconstruction/pose/solve_joint.h"
#include "tests/accuracy/real_sets/squirrel_set.h"

namespace scan {
namespace {

void ExpectCalibrated(const test::Squirrel& squirrel, const JointOptions& options) {
  const auto poses = SolveJoint(squirrel.mesh, squirrel.photos, squirrel.masks, options);
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (const std::string& note : poses->notes)  // the rig did its work
    for (const char* fault : {"stands", "moved", "other way", "differs", "bent"})
      EXPECT_EQ(note.find(fault), std::string::npos) << note;
  for (const ViewPose& view : poses->views)
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
  const auto figures =
      CompareWithCalibrated(*poses, squirrel.truth, squirrel.mesh, squirrel.photos, squirrel.masks);
  ASSERT_TRUE(figures) << ToString(figures.error());
  EXPECT_LE(figures->neighbour_deg.median, 0.4);
  EXPECT_LE(figures->aligned_deg.max, 1.2);
  EXPECT_LE(figures->contour.px.median, 1.2);
  ASSERT_TRUE(figures->axis_deg);
  EXPECT_LE(*figures->axis_deg, 0.4);
  ASSERT_EQ(figures->lens.size(), 4u);
  for (const MovedParameter& p : figures->lens) {
    EXPECT_GT(p.sigma, 0) << p.name;
    EXPECT_LE(std::abs(p.moved), 3 * p.sigma) << p.name;
  }
}

class SquirrelPose : public testing::Test {
 protected:
  void SetUp() override {
    squirrel_ =
        test::LoadSquirrel(std::string(SCAN_SOURCE_DIR) + "/../shared/data/squirrel_turntable");
    if (!squirrel_) GTEST_SKIP() << "the data folder is not here";
    test::IgnoreBase(squirrel_->masks);
  }
  std::optional<test::Squirrel> squirrel_;
};

TEST_F(SquirrelPose, AgreesWithTheCalibratedCameras) { ExpectCalibrated(*squirrel_, {}); }

TEST_F(SquirrelPose, AgreesWithTheCalibratedCamerasWithoutNominalPoses) {
  JointOptions options;
  options.no_priors = true;
  ExpectCalibrated(*squirrel_, options);
}

}  // namespace
}  // namespace scan
