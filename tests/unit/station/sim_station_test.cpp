#include "drivers/station/sim_station.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>

#include "drivers/base/units.h"
#include "drivers/base/virtual_clock.h"
#include "drivers/station/geometry.h"

namespace scan {
namespace {

// A grey picture that gets brighter to the right: enough to see that pixels arrive.
Result<cv::Mat> RenderRamp(const TrueState& state) {
  cv::Mat picture(state.intrinsics.h, state.intrinsics.w, CV_8UC3);
  for (int x = 0; x < picture.cols; ++x) {
    picture.col(x).setTo(cv::Scalar::all(60.0 + 120.0 * x / picture.cols));
  }
  return picture;
}

struct Rig {
  explicit Rig(ErrorLevel level, std::uint64_t seed = 1) : config(DefaultSimStation()) {
    config.sim.errors = DefaultSimErrors(level);
    config.sim.seed = seed;
    config.cameras[0].w = 240;
    config.cameras[0].h = 160;
    world = std::make_shared<SimWorld>(config);
    clock = std::make_shared<VirtualClock>();
    auto made = MakeSimStation(config, world, clock, RenderRamp,
                               [this](const FrameTruth& truth) { truths.push_back(truth); });
    EXPECT_TRUE(made) << ToString(made.error());
    station = std::move(*made);
  }
  CameraFromModel Nominal(const StagePosition& at, const std::string& aim) const {
    const CameraFromLift camera_from_lift =
        NominalCameraFromLift(config, config.cameras[0], *FindAim(config, aim));
    return NominalCameraFromTable(camera_from_lift, at.lift_mm.estimated, LiftDirection(config),
                                  RadFromDeg(at.turntable_deg.estimated)) *
           world->table_from_model();
  }
  StationConfig config;
  std::shared_ptr<SimWorld> world;
  std::shared_ptr<VirtualClock> clock;
  std::vector<FrameTruth> truths;
  Station station;
};

TEST(SimStation, TheIdealWorldStandsWhereTheDescriptionSays) {
  Rig rig(ErrorLevel::ideal);
  ASSERT_TRUE(rig.station.motion->Home({}));
  for (const RingConfig& ring : rig.config.plan.rings) {
    for (int k = 0; k < ring.count; ++k) {
      const StageTarget target{ring.start_deg + 360.0 * k / ring.count,
                               FindAim(rig.config, ring.aim)->lift_mm, ring.aim};
      const auto moved = rig.station.motion->MoveTo(target, {});
      ASSERT_TRUE(moved) << ToString(moved.error());
      ASSERT_TRUE(rig.station.cameras["c0"]->Grab({}));
      const TrueState& truth = rig.truths.back().state;
      const CameraFromModel nominal = rig.Nominal(moved->position, ring.aim);
      EXPECT_LT((nominal.isometry().matrix() - truth.camera_from_model.isometry().matrix()).norm(),
                1e-7);
      EXPECT_EQ(truth.intrinsics, NominalIntrinsics(rig.config.cameras[0]));
    }
  }
  EXPECT_EQ(rig.truths.size(), 24U);
}

}  // namespace
}  // namespace scan
