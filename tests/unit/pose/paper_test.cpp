#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/paper/paper_search.h"
#include "reconstruction/pose/paper/solve_paper.h"
#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/start_search.h"

namespace scan {
namespace {

const Intrinsics kReduced{462, 306, 1370, 1370, 231, 153, 0, 0, 0, 0, 0};

TEST(PaperCamera, LooksAtTheMassCentreFromTheDirectionAsked) {
  const Eigen::Vector3d centre(1, 2, 3), direction = Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
  const CameraFromModel pose = CameraFromModelOf(LookFrom(direction, 550), centre);
  EXPECT_LT((CameraCentre(pose) - (centre + 550 * direction)).norm(), 1e-9);
  EXPECT_LT((pose * centre - Eigen::Vector3d(0, 0, 550)).norm(), 1e-9);
  EXPECT_NEAR(pose.rotation().determinant(), 1, 1e-12);
}

TEST(PaperCamera, PositiveDeltasMoveThePictureAsEq5Says) {
  // Right with delta_y, up (a smaller row) with delta_z.
  PaperCamera camera = LookFrom(Eigen::Vector3d(0.3, -0.5, 0.8).normalized(), 550);
  camera.delta_y = 0.01;
  Eigen::Vector3d x = CameraFromModelOf(camera, Eigen::Vector3d::Zero()) * Eigen::Vector3d::Zero();
  EXPECT_NEAR(x.x() / x.z(), std::tan(0.01), 1e-9);
  camera.delta_y = 0;
  camera.delta_z = 0.01;
  x = CameraFromModelOf(camera, Eigen::Vector3d::Zero()) * Eigen::Vector3d::Zero();
  EXPECT_NEAR(x.y() / x.z(), -std::tan(0.01), 1e-9);
}

TEST(Paper, CostOfTheTruePoseIsNothing) {
  const TriangleMesh mesh = test::BugMesh(2);
  const CameraFromModel pose(ExpSo3({1.7, 0.2, 0.4}), Eigen::Vector3d(1, -2, 550));
  const ReducedPicture picture = ReducePicture(test::RenderMask(mesh, pose, kReduced), kReduced);
  const PictureCost cost = CostOfPose(picture, mesh, pose);
  EXPECT_LT(cost.l1_px, 0.1);
  const CameraFromModel off(ExpSo3({1.7, 0.2, 0.4}), Eigen::Vector3d(3, -2, 550));  // 5 px
  EXPECT_GT(CostOfPose(picture, mesh, off).l1_px, 1.0);
  EXPECT_GE(CostOfPose(picture, mesh, off).l1_px, CostOfPose(picture, mesh, off).l2_px);
}

// Eq 4 as it is written, nothing given up on the way.
double PlainCost(const PaperTemplate& t, const ReducedPicture& picture,
                 const Eigen::Vector2d& target, double angle) {
  double sum = 0;
  int count = 0;
  for (const Eigen::Vector2f& p : t.boundary) {
    const Eigen::Vector2d q = Eigen::Rotation2Dd(angle) * p.cast<double>() + target;
    const cv::Point at(static_cast<int>(std::floor(q.x())), static_cast<int>(std::floor(q.y())));
    if (!cv::Rect({0, 0}, picture.mask.size()).contains(at)) continue;
    sum += picture.distance_l1.at<float>(at);
    ++count;
  }
  return count > 0 ? sum / count : 1e9;
}

TEST(SearchTemplates, FindsTheLeastOfEq4AsAPlainSearchDoes) {
  const TriangleMesh mesh = test::BugMesh(1);
  const Eigen::Vector3d centre = MassCentre(mesh);
  const CameraFromModel pose(ExpSo3({1.7, 0.2, 0.4}), Eigen::Vector3d(14, -9, 550));
  const ReducedPicture picture = ReducePicture(test::RenderMask(mesh, pose, kReduced), kReduced);
  const auto templates =
      RenderTemplates(mesh, centre, IcosphereDirections(1), {540, 560}, kReduced);
  const cv::Moments m = cv::moments(picture.mask, true);
  const Eigen::Vector2d target(m.m10 / m.m00 + 0.5, m.m01 / m.m00 + 0.5);
  double least = 1e9;
  for (const PaperTemplate& t : templates)
    for (int angle = 0; angle < 360; angle += 5)
      least = std::min(least, PlainCost(t, picture, target, RadFromDeg(angle)));
  EXPECT_NEAR(SearchTemplates(templates, picture, 5).cost_px, least, 0.02);
}

test::Scene PaperScene() {
  test::SceneOptions options;
  options.w = 462;
  options.h = 306;
  options.views = 2;
  return test::MakeScene(test::BugMesh(2),
                         TableFromModel(ExpSo3({0.05, -0.1, 1.9}), Eigen::Vector3d(1.5, -2, 3)),
                         options);
}

PaperOptions ThinnedOut() {
  PaperOptions options;
  options.subdivisions = 3;
  options.distance_offsets_mm = {0};
  options.angle_step_deg = 3;
  options.chains = 3;
  options.hill_steps = 150;
  return options;
}

TEST(SolvePaper, FindsEachPhotographAlone) {
  const TriangleMesh mesh = test::BugMesh(2);
  const test::Scene scene = PaperScene();
  const auto poses = SolvePaper(mesh, scene.photos, scene.masks, ThinnedOut());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.cost_l1_px;
    EXPECT_LT(
        DegFromRad(AngleBetween(view.camera_from_model.rotation(), scene.truth[i].rotation())), 6)
        << view.name;
    EXPECT_TRUE(view.covariance.allFinite());
  }
}

TEST(SolvePaper, SameSeedSamePoses) {
  const TriangleMesh mesh = test::BugMesh(1);
  const test::Scene scene = PaperScene();
  PaperOptions options = ThinnedOut();
  options.subdivisions = 2;
  options.hill_steps = 40;
  const auto a = SolvePaper(mesh, scene.photos, scene.masks, options);
  const auto b = SolvePaper(mesh, scene.photos, scene.masks, options);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->views[1].camera_from_model.matrix34(), b->views[1].camera_from_model.matrix34());
}

TEST(SolvePaper, AnotherObjectFailsTheGate) {
  const test::Scene scene = PaperScene();
  const auto poses =
      SolvePaper(test::RevolutionMesh(24, {0, 0, 1}), scene.photos, scene.masks, ThinnedOut());
  ASSERT_TRUE(poses);
  for (const ViewPose& view : poses->views) {
    EXPECT_EQ(view.status, ViewStatus::rejected);
    EXPECT_NE(view.reason.find("gate"), std::string::npos);
  }
}

TEST(SolvePaper, BadInputIsRefused) {
  test::Scene scene = PaperScene();
  EXPECT_FALSE(SolvePaper(TriangleMesh{}, scene.photos, scene.masks, {}));
  for (Aim& aim : scene.photos.aims) aim.camera_from_lift.reset();
  const auto poses = SolvePaper(test::BugMesh(0), scene.photos, scene.masks, {});
  ASSERT_FALSE(poses);
  EXPECT_NE(ToString(poses.error()).find("approx_distance_mm"), std::string::npos);
}

}  // namespace
}  // namespace scan
