// Photographs without a logged pose, and evidence that is left out.
#include <gtest/gtest.h>

#include "drivers/base/rng.h"
#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/exclude_below.h"
#include "reconstruction/pose/residual_statistics.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"

namespace scan {
namespace {

const test::SceneOptions kSmallView{.w = 462, .h = 306, .views = 6};

const TableFromModel kPlacing(ExpSo3({0.1, -0.15, 1.3}), Eigen::Vector3d(1.5, -2, 1));

void ForgetPose(Photo& photo) {
  photo.camera_from_table.reset();
  photo.turntable_rad.reset();
}

TEST(RefineView, ReturnsFromAFewDegreesAndMillimetres) {
  const TriangleMesh mesh = test::BugMesh(2);
  const ContourMesh contour_mesh(mesh);
  const Intrinsics in{462, 306, 2055, 2055, 231, 153, 0, 0, 0, 0, 0};
  const CameraFromModel truth(ExpSo3({1.7, 0.2, 0.4}), Eigen::Vector3d(3, -2, 550));
  const PhotoContour photo = MakePhotoContour(test::RenderMask(mesh, truth, in));
  Vector6d off;
  off << 0.03, -0.04, 0.05, 1, -1, 12;
  RefineOptions options;
  options.first_window_px = 12;
  options.last_window_px = 4;
  options.spacing_px = 2;
  options.correlation_floor_px = 10;
  const CameraFromModel found = RefineView(
      contour_mesh, photo, {MovedAbout(truth, off, truth * contour_mesh.centre), in, 0}, options);
  EXPECT_LT(DegFromRad(AngleBetween(found.rotation(), truth.rotation())), 0.2);
  EXPECT_LT((CameraCentre(found) - CameraCentre(truth)).norm(), 2.5);
}

TEST(SolveJoint, PhotographsWithoutAPoseJoinThroughTheModel) {
  const TriangleMesh mesh = test::BugMesh(2);
  test::Scene scene = test::MakeScene(mesh, kPlacing, kSmallView);
  ForgetPose(scene.photos.photos[1]);
  ForgetPose(scene.photos.photos[4]);
  scene.photos.approx_distance_mm = 550;
  JointOptions options;
  options.table_from_model["m0"] = kPlacing;
  options.start.subdivisions = 3;
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, options);
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (const std::size_t i : {1, 4}) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.reason;
    EXPECT_LT(
        DegFromRad(AngleBetween(view.camera_from_model.rotation(), scene.truth[i].rotation())), 0.5)
        << view.name;
    EXPECT_EQ(view.mounting, "m0");
  }
  ASSERT_EQ(poses->mountings.size(), 1u);
  EXPECT_EQ(poses->mountings[0].id, "m0");
}

TEST(SolveJoint, WithoutAnyPriorEveryPhotographIsFoundAlone) {
  const TriangleMesh mesh = test::BugMesh(2);
  const test::Scene scene = test::MakeScene(mesh, kPlacing, {.w = 462, .h = 306, .views = 2});
  JointOptions options;
  options.no_priors = true;  // and no distance: it follows from the size
  options.start.subdivisions = 3;
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, options);
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.reason;
    EXPECT_LT(
        DegFromRad(AngleBetween(view.camera_from_model.rotation(), scene.truth[i].rotation())),
        0.5);
  }
  EXPECT_TRUE(poses->mountings.empty());
}

TEST(CorrelationLength, FindsTheIntegralOfTheAutocorrelation) {
  // A first-order process: correlation exp(-s / 20), integral over both sides 40 px.
  std::vector<std::vector<ContourMatch>> views(6);
  Rng rng(3);
  for (auto& view : views) {
    double r = rng.Normal();
    for (int i = 0; i < 4000; ++i) {
      const double keep = std::exp(-2.0 / 20);
      r = keep * r + std::sqrt(1 - keep * keep) * rng.Normal();
      view.push_back({Eigen::Vector3d::Zero(),
                      Eigen::Vector2d::Zero(),
                      Eigen::Vector2d::UnitX(),
                      0.7 * r,
                      2,
                      {},
                      2.0 * i});
    }
  }
  std::vector<std::span<const ContourMatch>> spans(views.begin(), views.end());
  EXPECT_NEAR(CorrelationLength(spans), 40, 7);
  for (auto& view : views)
    for (ContourMatch& match : view) match.residual_px = rng.Normal();
  EXPECT_LT(CorrelationLength(spans), 4);
  EXPECT_EQ(CorrelationLength({}), 0);
}

TEST(ExcludeBelow, IgnoresWhatStandsBelowAHeightOnTheAxis) {
  const TriangleMesh mesh = test::BugMesh(1);
  test::Scene scene = test::MakeScene(mesh, kPlacing, kSmallView);
  ASSERT_TRUE(ExcludeBelow(scene.photos, 3.0, scene.masks));
  for (std::size_t i = 0; i < scene.masks.size(); ++i) {
    const Photo& photo = scene.photos.photos[i];
    const CameraFromTable camera = *scene.photos.aims[photo.aim].camera_from_lift *
                                   LiftFromStation() *
                                   MakeStationFromTable(photo.turntable_rad->nominal);
    const auto ignored = [&](double height_mm) {
      const auto p =
          Project(scene.photos.intrinsics(photo), camera * Eigen::Vector3d(0, 0, height_mm));
      return scene.masks[i].ignore.at<uchar>(static_cast<int>(p->y()), static_cast<int>(p->x())) !=
             0;
    };
    EXPECT_TRUE(ignored(1.5));
    EXPECT_FALSE(ignored(4.5));
  }
  EXPECT_FALSE(ExcludeBelow(scene.photos, std::nan(""), scene.masks));
  ForgetPose(scene.photos.photos[0]);
  const Status status = ExcludeBelow(scene.photos, 3.0, scene.masks);
  ASSERT_FALSE(status);
  EXPECT_NE(ToString(status.error()).find("nominal pose"), std::string::npos);
}

TEST(MatchContour, AnIgnoredRegionNeedsNoPartner) {
  const TriangleMesh mesh = test::BugMesh(2);
  const ContourMesh contour_mesh(mesh);
  const ViewState state = test::BugView();
  Mask mask = test::RenderMask(mesh, state.camera_from_model, state.intrinsics);
  // The left half of the specimen is missing in the photograph.
  mask.coverage(cv::Rect(0, 0, 462, 612)).setTo(0);
  const auto samples =
      FindContourSamples(contour_mesh, state.camera_from_model, state.intrinsics, 2);
  EXPECT_GT(MatchContour(samples, MakePhotoContour(mask), 0, 8).unmatched_px, 100);
  mask.ignore = cv::Mat(mask.coverage.size(), CV_8U, cv::Scalar(0));
  mask.ignore(cv::Rect(0, 0, 466, 612)).setTo(255);
  EXPECT_LT(MatchContour(samples, MakePhotoContour(mask), 0, 8).unmatched_px, 5);
}

}  // namespace
}  // namespace scan
