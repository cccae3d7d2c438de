#include "reconstruction/evaluate/pose_trial.h"

#include <gtest/gtest.h>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

const Eigen::Vector3d kAxis = Eigen::Vector3d(0.2, -0.3, 0.9).normalized();
const Eigen::Vector3d kPoint(1, 2, -1);

// A small trial and poses that are the truth itself.
struct Case {
  PoseTrial trial;
  Poses poses;
};

Case MakeCase() {
  Case c;
  c.trial.surface = c.trial.mesh = test::BugMesh(1);
  test::SceneOptions options;
  options.w = 462;
  options.h = 306;
  options.views = 4;
  test::Scene scene = test::MakeScene(c.trial.mesh, TableFromModel(), options);
  c.trial.photos = scene.photos;
  c.trial.masks = scene.masks;
  for (std::size_t i = 0; i < scene.truth.size(); ++i) {
    c.trial.truth.push_back({scene.truth[i], scene.true_intrinsics[i]});
    ViewPose view;
    view.name = scene.photos.photos[i].name;
    view.mounting = scene.photos.photos[i].mounting_id;
    view.status = ViewStatus::accepted;
    view.camera_from_model = scene.truth[i];
    view.covariance.setIdentity();
    c.poses.views.push_back(view);
  }
  c.poses.method = "joint";
  return c;
}

FreeDirection FreeTurn() {
  FreeDirection free;
  free.of = "m0";
  free.axis = kAxis;
  free.point = kPoint;
  return free;
}

CameraFromModel TurnedBy(const CameraFromModel& pose, double angle) {
  const Eigen::Matrix3d turn = ExpSo3(angle * kAxis);
  return pose * Transform<frame::Model, frame::Model>(turn, kPoint - turn * kPoint);
}

TEST(ScorePoses, TheTruthIsRight) {
  const Case c = MakeCase();
  const MethodFigures figures = ScorePoses(c.trial, c.poses, {});
  const MethodSummary summary = Summarise(figures, 5);
  EXPECT_EQ(summary.accepted, 4u);
  EXPECT_EQ(summary.wrong, 0u);
  EXPECT_LT(summary.surface_px.max, 1e-6);
  EXPECT_LT(summary.centre_mm.max, 1e-9);
  EXPECT_LT(summary.mean_nees, 1e-9);
}

TEST(ScorePoses, ATurnCommonToAllViewsIsTakenOffAboutAFreeAxisOnly) {
  Case c = MakeCase();
  for (ViewPose& view : c.poses.views)
    view.camera_from_model = TurnedBy(view.camera_from_model, 2.5);
  const std::vector<FreeDirection> free{FreeTurn()};
  const MethodSummary with = Summarise(ScorePoses(c.trial, c.poses, free), 5);
  EXPECT_LT(with.surface_px.max, 1e-6);
  EXPECT_EQ(with.wrong, 0u);
  EXPECT_GT(with.surface_raw_px.median, 20);
  EXPECT_EQ(Summarise(ScorePoses(c.trial, c.poses, {}), 5).wrong, 4u);
}

TEST(ScorePoses, ViewsThatDisagreeAboutAFreeTurnStayWrong) {
  Case c = MakeCase();
  for (ViewPose& view : c.poses.views)
    view.camera_from_model = TurnedBy(view.camera_from_model, 0.4);
  c.poses.views[2].camera_from_model = TurnedBy(c.poses.views[2].camera_from_model, 2);
  const std::vector<FreeDirection> free{FreeTurn()};
  const MethodFigures figures = ScorePoses(c.trial, c.poses, free);
  EXPECT_EQ(Summarise(figures, 5).wrong, 1u);
  EXPECT_GT(figures.views[2].turned.surface_rms_px, 5);
  EXPECT_LT(figures.views[0].turned.surface_rms_px, 1e-6);
}

TEST(ScorePoses, AFreeTurnOfOneViewIsTakenOffThereOnly) {
  Case c = MakeCase();
  for (const std::size_t i : {1, 2})
    c.poses.views[i].camera_from_model = TurnedBy(c.poses.views[i].camera_from_model, 1.5);
  FreeDirection free = FreeTurn();
  free.scope = FreeDirection::Scope::view;
  free.of = c.poses.views[2].name;
  const MethodFigures figures = ScorePoses(c.trial, c.poses, std::span(&free, 1));
  EXPECT_LT(figures.views[2].turned.surface_rms_px, 1e-6);
  EXPECT_GT(figures.views[1].turned.surface_rms_px, 5);
  EXPECT_EQ(Summarise(figures, 5).wrong, 1u);
}

TEST(ScorePoses, RejectedViewsCountNowhere) {
  Case c = MakeCase();
  c.poses.views[1].camera_from_model = TurnedBy(c.poses.views[1].camera_from_model, 1);
  c.poses.views[1].status = ViewStatus::rejected;
  const MethodSummary summary = Summarise(ScorePoses(c.trial, c.poses, {}), 5);
  EXPECT_EQ(summary.accepted, 3u);
  EXPECT_EQ(summary.wrong, 0u);
  EXPECT_LT(summary.surface_px.max, 1e-6);
}

TEST(ScorePoses, NeesIsInUnitsOfTheReportedCovariance) {
  Case c = MakeCase();
  Vector6d motion;
  motion << 1e-3, -2e-3, 0, 0.3, 0, -0.4;
  for (std::size_t i = 0; i < c.poses.views.size(); ++i) {
    // The truth is the estimate moved by `motion` about the camera centre.
    c.trial.truth[i].camera_from_model =
        MovedAbout(c.poses.views[i].camera_from_model, motion, Eigen::Vector3d::Zero());
    c.poses.views[i].covariance.diagonal() << 1e-6, 4e-6, 1e-6, 0.09, 1, 0.04;
  }
  // 1 + 1 + 0 + 1 + 0 + 4
  EXPECT_NEAR(ScorePoses(c.trial, c.poses, {}).views[0].nees, 7, 1e-6);
}

TEST(Summarise, SetsErrorsBesideTheReportedSigmas) {
  Case c = MakeCase();
  Vector6d motion = Vector6d::Zero();
  motion[3] = 3;
  for (std::size_t i = 0; i < c.poses.views.size(); ++i) {
    c.trial.truth[i].camera_from_model =
        MovedAbout(c.poses.views[i].camera_from_model, motion, Eigen::Vector3d::Zero());
    c.poses.views[i].covariance.diagonal().tail<3>() << 1, 4, 4;
  }
  const MethodFigures figures = ScorePoses(c.trial, c.poses, {});
  const MethodSummary summary = Summarise(figures, 1e6);
  EXPECT_NEAR(summary.centre_rms_mm, 3, 1e-6);
  EXPECT_NEAR(summary.centre_per_sigma, 1, 1e-6);
  EXPECT_EQ(CountWithin(figures, 3.1, 0.1), 4u);
  EXPECT_EQ(CountWithin(figures, 2.9, 0.1), 0u);
}

TEST(Subset, KeepsPhotosMasksAndTruthTogether) {
  const Case c = MakeCase();
  const std::vector<std::size_t> indices = EvenlySpread(4, 2);
  EXPECT_EQ(indices, (std::vector<std::size_t>{0, 2}));
  const PoseTrial subset = Subset(c.trial, indices);
  ASSERT_EQ(subset.photos.photos.size(), 2u);
  EXPECT_EQ(subset.photos.photos[1].name, c.trial.photos.photos[2].name);
  EXPECT_EQ(subset.truth[1].camera_from_model.matrix34(),
            c.trial.truth[2].camera_from_model.matrix34());
  EXPECT_EQ(subset.masks.size(), 2u);
  EXPECT_EQ(EvenlySpread(3, 9).size(), 3u);
}

}  // namespace
}  // namespace scan
