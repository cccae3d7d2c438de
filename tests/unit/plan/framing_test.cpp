#include "acquisition/plan/framing.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "drivers/base/units.h"

namespace scan {
namespace {

Intrinsics SomeIntrinsics() {
  Intrinsics k;
  k.w = 924;
  k.h = 612;
  k.fl_x = k.fl_y = 2740;
  k.cx = 462;
  k.cy = 306;
  return k;
}

// A camera on the station's -y side at `height_mm`, looking at (0, 0, look_at_mm).
CameraFromLift LookingFrom(double distance_mm, double height_mm, double look_at_mm) {
  const Eigen::Vector3d centre(0, -distance_mm, height_mm);
  const Eigen::Vector3d z = (Eigen::Vector3d(0, 0, look_at_mm) - centre).normalized();
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rotation;
  rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
  return CameraFromLift(rotation, -rotation * centre);
}

StationDocument SomeRig() {
  CameraDocument camera;
  camera.id = "c0";
  camera.intrinsics = SomeIntrinsics();
  camera.camera_from_lift = {{"a0", LookingFrom(530, 0, -90)}, {"a1", LookingFrom(400, 0, -360)}};
  StationDocument station;
  station.cameras = {camera};
  return station;
}

PlannedView ViewAt(const std::string& aim, double lift_mm) {
  PlannedView view;
  view.id = "v007";
  view.camera = "c0";
  view.aim_id = aim;
  view.lift_mm = lift_mm;
  return view;
}

TEST(Framing, NominalPoseFollowsTheConvention) {
  // The platter turned by +90 deg carries table +x to station +y.
  StationDocument rig = SomeRig();
  rig.cameras[0].camera_from_lift["a0"] = CameraFromLift();
  const auto pose = NominalPose(rig, "c0", "a0", 90, 25);
  ASSERT_TRUE(pose);
  EXPECT_TRUE((*pose * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(0, 1, -25), 1e-12));
}

TEST(Framing, RaisingTheCameraWithoutAimingLosesTheSpecimen) {
  const BoundingCylinder cylinder{15, 0, 30};
  EXPECT_TRUE(CheckFraming({ViewAt("a0", 105)}, SomeRig(), cylinder, 10));
  EXPECT_TRUE(CheckFraming({ViewAt("a1", 375)}, SomeRig(), cylinder, 10));
  const Status lost = CheckFraming({ViewAt("a0", 105), ViewAt("a0", 375)}, SomeRig(), cylinder, 10);
  ASSERT_FALSE(lost);
  const std::string text = ToString(lost.error());
  EXPECT_EQ(lost.error().kind, ErrorKind::bad_input);
  for (const char* part : {"v007", "aim a0", "lower border", " px", " mm", "re-aim"})
    EXPECT_NE(text.find(part), std::string::npos) << part << " in: " << text;
}

TEST(Framing, MarginCounts) {
  // The cylinder's lowest and highest points decide; widen the margin until it does not fit.
  const BoundingCylinder cylinder{15, 0, 30};
  EXPECT_TRUE(CheckFraming({ViewAt("a0", 105)}, SomeRig(), cylinder, 0));
  EXPECT_FALSE(CheckFraming({ViewAt("a0", 105)}, SomeRig(), cylinder, 250));
}

TEST(Framing, SpecimenBehindTheCameraIsNamed) {
  const Status status = CheckFraming({ViewAt("a0", 105)}, SomeRig(), {600, 0, 30}, 0);
  ASSERT_FALSE(status);
  EXPECT_NE(status.error().what.find("behind the camera"), std::string::npos);
}

TEST(Framing, RefusesUnknownCameraAimAndCylinder) {
  PlannedView view = ViewAt("a0", 105);
  view.camera = "c9";
  EXPECT_FALSE(CheckFraming({view}, SomeRig(), {15, 0, 30}, 0));
  EXPECT_FALSE(CheckFraming({ViewAt("a9", 105)}, SomeRig(), {15, 0, 30}, 0));
  EXPECT_FALSE(CheckFraming({ViewAt("a0", 105)}, SomeRig(), {0, 0, 30}, 0));
  EXPECT_FALSE(CheckFraming({ViewAt("a0", 105)}, SomeRig(), {15, 30, 0}, 0));
  EXPECT_FALSE(CheckFraming({ViewAt("a0", 105)}, SomeRig(), {15, 0, 30}, -1));
}

// Accepted exactly when every point inside projects inside: no point of an accepted cylinder
// leaves the picture, at any turntable angle.
TEST(Framing, NoPointOfAnAcceptedCylinderLeavesThePicture) {
  EXPECT_TRUE(rc::check([] {
    const double radius = 0.25 * *rc::gen::inRange(1, 200);
    const double low = -5 + 0.25 * *rc::gen::inRange(0, 60);
    const double high = low + 0.25 * *rc::gen::inRange(1, 200);
    StationDocument rig = SomeRig();
    rig.cameras[0].intrinsics.k1 = 0.01 * *rc::gen::inRange(-30, 30);
    PlannedView view = ViewAt("a0", 60 + *rc::gen::inRange(0, 90));
    view.turntable_deg = *rc::gen::inRange(0, 360);
    const double margin = *rc::gen::inRange(0, 40);
    const bool accepted = CheckFraming({view}, rig, {radius, low, high}, margin).has_value();
    RC_CLASSIFY(accepted);
    if (!accepted) return;
    const auto pose = NominalPose(rig, "c0", "a0", view.turntable_deg, view.lift_mm);
    const double r = radius * std::sqrt(*rc::gen::inRange(0, 1000) / 1000.0);
    const double a = RadFromDeg(0.1 * *rc::gen::inRange(0, 3600));
    const double z = low + (high - low) * *rc::gen::inRange(0, 1000) / 1000.0;
    const Intrinsics& k = rig.cameras[0].intrinsics;
    const auto pixel = Project(k, *pose * Eigen::Vector3d(r * std::cos(a), r * std::sin(a), z));
    RC_ASSERT(pixel.has_value());
    const double slack = 0.05;  // between the samples of the rim
    RC_ASSERT(pixel->x() >= margin - slack && pixel->x() <= k.w - margin + slack);
    RC_ASSERT(pixel->y() >= margin - slack && pixel->y() <= k.h - margin + slack);
  }));
}

}  // namespace
}  // namespace scan
