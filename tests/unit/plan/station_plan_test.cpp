#include "acquisition/plan/station_plan.h"

#include <gtest/gtest.h>

#include "acquisition/plan/framing.h"
#include "drivers/base/units.h"
#include "drivers/station/geometry.h"

namespace scan {
namespace {

SessionDocument DefaultDocument() {
  const StationConfig config = DefaultSimStation();
  SessionDocument document;
  document.id = "s0";
  document.station = DescribeStation(config);
  document.views = PlanOfStation(config).value();
  return document;
}

TEST(StationPlan, DescribesTheDefaultStationInAValidDocument) {
  const Status valid = ValidateSessionDocument(DefaultDocument(), "session.json");
  EXPECT_TRUE(valid) << ToString(valid.error());
}

TEST(StationPlan, NominalPosesAgreeWithTheStationsGeometry) {
  const StationConfig config = DefaultSimStation();
  const SessionDocument document = DefaultDocument();
  ASSERT_EQ(document.views.size(), 24u);
  for (const PlannedView& view : document.views) {
    const auto pose =
        NominalPose(document.station, view.camera, view.aim_id, view.turntable_deg, view.lift_mm);
    ASSERT_TRUE(pose);
    const AimConfig& aim = *FindAim(config, view.aim_id);
    EXPECT_EQ(view.lift_mm, aim.lift_mm);
    const CameraFromTable expected =
        NominalCameraFromTable(NominalCameraFromLift(config, config.cameras[0], aim), view.lift_mm,
                               LiftDirection(config), RadFromDeg(view.turntable_deg));
    EXPECT_TRUE(pose->isometry().isApprox(expected.isometry(), 1e-12));
  }
}

TEST(StationPlan, DefaultPlanShowsASpecimenOnItsStand) {
  const SessionDocument document = DefaultDocument();
  const Status fits = CheckFraming(document.views, document.station, {20, 20, 50}, 10);
  EXPECT_TRUE(fits) << ToString(fits.error());
  // With one aim for both heights, the specimen is out of the picture.
  auto views = document.views;
  for (auto& view : views) view.aim_id = "a0";
  EXPECT_FALSE(CheckFraming(views, document.station, {20, 20, 50}, 10));
}

}  // namespace
}  // namespace scan
