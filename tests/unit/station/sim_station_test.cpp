#include "drivers/station/sim_station.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "drivers/base/virtual_clock.h"
#include "drivers/station/geometry.h"

namespace scan {
namespace {

// A white disc where the model's origin is seen, on grey.
Result<cv::Mat> RenderDisc(const TrueState& state) {
  cv::Mat picture(state.intrinsics.h, state.intrinsics.w, CV_8UC3, cv::Scalar::all(90));
  const auto pixel =
      Project(state.intrinsics, state.camera_from_model * Eigen::Vector3d(10, 0, 15));
  if (state.specimen_present && pixel) {
    cv::circle(picture, {static_cast<int>(pixel->x()), static_cast<int>(pixel->y())}, 4,
               cv::Scalar(40, 220, 250), cv::FILLED);
  }
  return picture;
}

StationConfig SmallStation(ErrorLevel level, std::uint64_t seed = 1) {
  StationConfig config = DefaultSimStation();
  config.sim.errors = DefaultSimErrors(level);
  config.sim.errors.late_frames = 0;
  config.sim.seed = seed;
  config.cameras[0].w = 240;
  config.cameras[0].h = 160;
  return config;
}

struct Rig {
  explicit Rig(StationConfig with) : config(std::move(with)) {
    world = std::make_shared<SimWorld>(config);
    clock = std::make_shared<VirtualClock>();
    auto made = MakeSimStation(config, world, clock, RenderDisc,
                               [this](const FrameTruth& truth) { truths.push_back(truth); });
    EXPECT_TRUE(made) << ToString(made.error());
    station = std::move(*made);
  }
  StagePosition Visit(const StageTarget& target) {
    const auto moved = station.motion->MoveTo(target, {});
    EXPECT_TRUE(moved) << ToString(moved.error());
    return moved ? moved->position : StagePosition{};
  }
  Frame Grab() {
    auto frame = station.cameras["c0"]->Grab({});
    EXPECT_TRUE(frame) << ToString(frame.error());
    return frame.value_or(Frame{});
  }
  CameraFromModel Nominal(const StagePosition& at, const std::string& aim) const {
    const CameraFromLift camera_from_lift =
        NominalCameraFromLift(config, config.cameras[0], *FindAim(config, aim));
    return NominalCameraFromTable(camera_from_lift, at.lift_mm.estimated, LiftDirection(config),
                                  RadFromDeg(at.turntable_deg.estimated)) *
           world->table_from_model();
  }
  template <class Check>
  void VisitPlan(Check check) {
    ASSERT_TRUE(station.motion->Home({}));
    for (const RingConfig& ring : config.plan.rings) {
      for (int k = 0; k < ring.count; ++k) {
        const StagePosition at = Visit({ring.start_deg + 360.0 * k / ring.count,
                                        FindAim(config, ring.aim)->lift_mm, ring.aim});
        const Frame frame = Grab();
        check(at, ring.aim, frame, truths.back());
      }
    }
  }
  StationConfig config;
  std::shared_ptr<SimWorld> world;
  std::shared_ptr<VirtualClock> clock;
  std::vector<FrameTruth> truths;
  Station station;
};

double RotationBetweenDeg(const CameraFromModel& a, const CameraFromModel& b) {
  return DegFromRad(Eigen::AngleAxisd(a.rotation() * b.rotation().transpose()).angle());
}

TEST(Geometry, TheCameraLooksAtTheAxisFromTheStatedPlace) {
  const auto camera_from_station = LookAtAxis(550, RadFromDeg(45), RadFromDeg(-90), 35);
  EXPECT_TRUE(
      (camera_from_station * Eigen::Vector3d(0, 0, 35)).isApprox(Eigen::Vector3d(0, 0, 550)));
  EXPECT_TRUE(CameraCentre(camera_from_station)
                  .isApprox(Eigen::Vector3d(0, -550 * std::sqrt(0.5), 35 + 550 * std::sqrt(0.5))));
  // Image x is the station's x, and up in the station is up in the picture.
  EXPECT_NEAR((camera_from_station * Eigen::Vector3d(1, 0, 35)).x(), 1, 1e-12);
  EXPECT_LT((camera_from_station * Eigen::Vector3d(0, 0, 36)).y(), 0);
  EXPECT_NEAR(camera_from_station.rotation().determinant(), 1, 1e-12);
}

TEST(Geometry, EveryAimSeesItsPointAtItsLiftHeight) {
  const StationConfig config = DefaultSimStation();
  for (const AimConfig& aim : config.aims) {
    const auto camera_from_table =
        NominalCameraFromTable(NominalCameraFromLift(config, config.cameras[0], aim), aim.lift_mm,
                               LiftDirection(config), 0);
    const Eigen::Vector3d seen = camera_from_table * Eigen::Vector3d(0, 0, aim.look_at_mm);
    EXPECT_LT((seen - Eigen::Vector3d(0, 0, aim.distance_mm)).norm(), 1e-9);
  }
}

TEST(Geometry, FocalLengthInPixels) {
  const Intrinsics in = NominalIntrinsics(DefaultSimStation().cameras[0]);
  EXPECT_NEAR(in.fl_x, 70 / 23.6 * 1848, 1e-9);
  EXPECT_EQ(in.cx, 924);
  EXPECT_EQ(in.cy, 612);
}

TEST(SimStation, TheIdealWorldStandsWhereTheDescriptionSays) {
  Rig rig(SmallStation(ErrorLevel::ideal));
  rig.VisitPlan([&](const StagePosition& at, const std::string& aim, const Frame&,
                    const FrameTruth& truth) {
    const CameraFromModel nominal = rig.Nominal(at, aim);
    EXPECT_LT(
        (nominal.isometry().matrix() - truth.state.camera_from_model.isometry().matrix()).norm(),
        1e-7);
    EXPECT_EQ(truth.state.intrinsics, NominalIntrinsics(rig.config.cameras[0]));
  });
  EXPECT_EQ(rig.truths.size(), 24U);
}

TEST(SimStation, TheStaticWorldIsOffByNoMoreThanItsSizesAllow) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    Rig rig(SmallStation(ErrorLevel::static_errors, seed));
    const SimErrors& e = rig.config.sim.errors;
    // Tilt turns the platter under the camera; rotation of the aim is cut at 2 sigma a component.
    const double rotation_deg = e.axis_tilt_deg + 2 * std::sqrt(3.0) * e.aim_rotation_deg;
    const double lever_mm = 620;  // camera centre from the table's origin
    const double centre_mm = lever_mm * RadFromDeg(rotation_deg) +
                             2 * std::sqrt(3.0) * e.aim_translation_mm + e.runout_mm +
                             e.lift_scale_rel * 200;
    double largest_mm = 0, largest_deg = 0;
    rig.VisitPlan([&](const StagePosition& at, const std::string& aim, const Frame&,
                      const FrameTruth& truth) {
      const CameraFromModel nominal = rig.Nominal(at, aim);
      const CameraFromModel& exact = truth.state.camera_from_model;
      largest_mm = std::max(largest_mm, (CameraCentre(nominal) - CameraCentre(exact)).norm());
      largest_deg = std::max(largest_deg, RotationBetweenDeg(nominal, exact));
    });
    EXPECT_LT(largest_mm, centre_mm);
    EXPECT_LT(largest_deg, rotation_deg);
    EXPECT_GT(largest_mm, 0.5);
    EXPECT_GT(largest_deg, 0.1);
    const Intrinsics exact = rig.world->TrueIntrinsics("c0");
    const Intrinsics nominal = NominalIntrinsics(rig.config.cameras[0]);
    EXPECT_NEAR(std::abs(exact.fl_x / nominal.fl_x - 1), 0.0005, 1e-12);
    EXPECT_NEAR(std::hypot(exact.cx - nominal.cx, exact.cy - nominal.cy), 3, 1e-9);
  }
}

TEST(SimStation, StaticErrorsRepeatOverATurnAndDynamicOnesDoNot) {
  for (const bool dynamic : {false, true}) {
    Rig rig(SmallStation(dynamic ? ErrorLevel::dynamic : ErrorLevel::static_errors));
    ASSERT_TRUE(rig.station.motion->Home({}));
    double sum_of_squares = 0;
    TrueState before;
    for (int turn = 0; turn <= 20; ++turn) {
      rig.Visit({360.0 * turn, 20, "a0"});
      rig.Grab();
      const TrueState now = rig.truths.back().state;
      if (turn > 0) {
        const double change =
            std::remainder(DegFromRad(now.turntable_rad - before.turntable_rad), 360.0);
        sum_of_squares += change * change;
      }
      before = now;
    }
    const double sigma_deg = std::sqrt(sum_of_squares / 20 / 2);
    if (dynamic) {
      EXPECT_GT(sigma_deg, 0.05);
      EXPECT_LT(sigma_deg, 0.2);
    } else {
      EXPECT_LT(sigma_deg, 1e-9);
    }
  }
}

TEST(SimStation, PositiveAnglesTurnCounterClockwiseSeenFromAbove) {
  Rig rig(SmallStation(ErrorLevel::static_errors));
  ASSERT_TRUE(rig.station.motion->Home({}));
  const auto seen_at = [&](double deg) -> Eigen::Vector3d {
    rig.Visit({deg, 20, "a0"});
    rig.Grab();
    const CameraFromTable camera_from_table =
        rig.truths.back().state.camera_from_model * rig.world->table_from_model().inverse();
    return camera_from_table * Eigen::Vector3d(20, 0, 35);
  };
  // The camera stands at -y with image x along +x: a point on the right goes away from it.
  const Eigen::Vector3d before = seen_at(0), after = seen_at(20);
  EXPECT_GT(before.x(), 15);
  EXPECT_GT(after.z(), before.z() + 5);
}

TEST(SimStation, PositiveLiftIsUp) {
  Rig rig(SmallStation(ErrorLevel::static_errors));
  ASSERT_TRUE(rig.station.motion->Home({}));
  rig.Visit({0, 20, "a0"});
  rig.Grab();
  rig.Visit({0, 30, "a0"});
  rig.Grab();
  const Eigen::Vector3d top(0, 0, 30);
  const Eigen::Vector3d low = rig.truths[0].state.camera_from_model * top;
  const Eigen::Vector3d high = rig.truths[1].state.camera_from_model * top;
  EXPECT_GT(high.y(), low.y() + 8);  // the specimen sinks in the picture
}

TEST(SimStation, LostStepsStayLostUntilHomed) {
  StationConfig config = SmallStation(ErrorLevel::ideal);
  Rig rig(config);
  ASSERT_TRUE(rig.station.motion->Home({}));
  rig.Visit({30, 20, "a0"});
  rig.world->LoseSteps("turntable", 72);  // 1.8 degrees
  const StagePosition at = rig.Visit({60, 20, "a0"});
  EXPECT_NEAR(at.turntable_deg.counted, 60, 1e-9);
  rig.Grab();
  EXPECT_NEAR(DegFromRad(rig.truths.back().state.turntable_rad), 60 - 1.8, 1e-9);
  ASSERT_TRUE(rig.station.motion->Home({}));
  rig.Visit({60, 20, "a0"});
  rig.Grab();
  EXPECT_NEAR(std::remainder(DegFromRad(rig.truths.back().state.turntable_rad) - 60, 360), 0, 1e-9);
}

TEST(SimStation, TheSameSeedGivesTheSameBytes) {
  for (const char* format : {"jpg", "png"}) {
    std::vector<Frame> runs[2];
    for (auto& frames : runs) {
      StationConfig config = SmallStation(ErrorLevel::dynamic, 9);
      config.sim.format = format;
      config.plan.rings = {{"a0", 3, 0}, {"a1", 2, 10}};
      Rig rig(config);
      rig.VisitPlan([&](const StagePosition&, const std::string&, const Frame& frame,
                        const FrameTruth&) { frames.push_back(frame); });
    }
    ASSERT_EQ(runs[0].size(), 5U);
    for (std::size_t k = 0; k < 5; ++k) {
      EXPECT_EQ(runs[0][k].files, runs[1][k].files);
      EXPECT_EQ(runs[0][k].exposure, runs[1][k].exposure);
    }
    EXPECT_NE(runs[0][0].files, runs[0][1].files);
  }
}

cv::Mat Decode(const Frame& frame) {
  const auto& bytes = frame.files.at(0).bytes;
  return cv::imdecode(
      cv::Mat(1, static_cast<int>(bytes.size()), CV_8U, const_cast<std::byte*>(bytes.data())),
      cv::IMREAD_COLOR);
}

TEST(SimCamera, JpegKeepsFullChroma) {
  Rig rig(SmallStation(ErrorLevel::ideal));
  const Frame frame = rig.Grab();
  const auto& bytes = frame.files.at(0).bytes;
  // Start of frame, baseline: length, precision, h, w, components, then id, sampling, table each.
  for (std::size_t i = 0; i + 20 < bytes.size(); ++i) {
    if (bytes[i] != std::byte{0xff} || bytes[i + 1] != std::byte{0xc0}) continue;
    for (int component = 0; component < 3; ++component) {
      EXPECT_EQ(bytes[i + 11 + 3 * component], std::byte{0x11});
    }
    return;
  }
  FAIL() << "no baseline frame header";
}

TEST(SimCamera, NoiseHasTheStatedSize) {
  StationConfig config = SmallStation(ErrorLevel::ideal);
  config.sim.format = "png";
  config.sim.noise = 3;
  Rig rig(config);
  rig.world->SetSpecimenPresent(false);
  cv::Scalar mean, sigma;
  cv::meanStdDev(Decode(rig.Grab()), mean, sigma);
  EXPECT_NEAR(mean[0], 90, 0.1);
  EXPECT_NEAR(sigma[1], 3 * std::sqrt(0.5 + 0.5 * 90 / 128), 0.1);
}

TEST(SimCamera, WithoutLightThePictureIsDarkAndWithoutSpecimenThePlate) {
  Rig rig(SmallStation(ErrorLevel::ideal));
  ASSERT_TRUE(rig.station.motion->Home({}));
  rig.Visit({0, 20, "a0"});
  const auto brightest = [&] {
    double high = 0;
    cv::minMaxLoc(Decode(rig.Grab()).reshape(1), nullptr, &high);
    return high;
  };
  EXPECT_GT(brightest(), 200);
  rig.world->SetSpecimenPresent(false);
  EXPECT_LT(brightest(), 120);
  ASSERT_TRUE(rig.station.light->Set(false));
  EXPECT_LT(brightest(), 20);
  EXPECT_FALSE(rig.truths.back().state.light_on);
  ASSERT_TRUE(rig.station.light->Set(true));
  rig.world->SetSpecimenPresent(true);
  EXPECT_GT(brightest(), 200);
}

TEST(SimCamera, ALateFrameWasExposedBeforeTheCall) {
  StationConfig config = SmallStation(ErrorLevel::dynamic);
  config.sim.errors.late_frames = 1;
  Rig rig(config);
  int late = 0;
  for (int k = 0; k < 6; ++k) {
    const std::int64_t called_ns = rig.clock->Now().mono_ns;
    const Frame frame = rig.Grab();
    if (frame.exposure.not_before_ns < called_ns) ++late;
  }
  EXPECT_EQ(late, 1);
}

TEST(SimCamera, SettingsApplyAsManyFramesLaterAsStated) {
  StationConfig config = SmallStation(ErrorLevel::ideal);
  config.sim.settings_delay_frames = 2;
  Rig rig(config);
  CameraSettings settings;
  settings.exposure_us = 1234;
  ASSERT_TRUE(rig.station.cameras["c0"]->Configure(settings));
  EXPECT_EQ(rig.Grab().applied.exposure_us, 8000);
  EXPECT_EQ(rig.Grab().applied.exposure_us, 8000);
  EXPECT_EQ(rig.Grab().applied.exposure_us, 1234);
}

TEST(SimStation, AConfigurationThatIsNotValidMakesNoStation) {
  StationConfig config = SmallStation(ErrorLevel::ideal);
  config.aims.clear();
  const auto world = std::make_shared<SimWorld>(config);
  const auto made = MakeSimStation(config, world, std::make_shared<VirtualClock>(), RenderDisc);
  ASSERT_FALSE(made);
  EXPECT_EQ(made.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace scan
