#include "reconstruction/evaluate/fig12.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <opencv2/core.hpp>

#include "drivers/base/units.h"
#include "pose_scene.h"
#include "reconstruction/pose/rigid_motion.h"

namespace scan {
namespace {

Fig12Options Small() {
  Fig12Options options;
  options.cameras = 12;
  options.w = 231;
  options.h = 153;
  return options;
}

TEST(Fig12, CamerasLieInTheProtocolsRanges) {
  const TriangleMesh mesh = test::BugMesh(1);
  Fig12Options options = Small();
  options.cameras = 40;
  options.samples = 1;
  const PoseTrial trial = MakeFig12Trial(mesh, options);
  ASSERT_EQ(trial.truth.size(), 40u);
  ASSERT_EQ(trial.photos.photos.size(), 40u);
  ASSERT_EQ(trial.masks.size(), 40u);
  const Eigen::Vector3d centre = MassCentre(mesh);
  double nearest = 1e9, farthest = 0;
  for (const PoseOf& camera : trial.truth) {
    EXPECT_DOUBLE_EQ(camera.intrinsics.fl_x, 105 / 23.6 * 231);
    const Eigen::Vector3d seen = camera.camera_from_model * centre;
    nearest = std::min(nearest, seen.norm());
    farthest = std::max(farthest, seen.norm());
    // Off the middle by the two small angles at most.
    EXPECT_LE(std::acos(seen.z() / seen.norm()), std::sqrt(2.0) * 0.006 * kPi + 1e-9);
    // Elevation of the camera above the equator; the pole is the y axis (Eq 1).
    const Eigen::Vector3d from = CameraCentre(camera.camera_from_model) - centre;
    EXPECT_LE(std::abs(std::asin(from.y() / from.norm())), 0.35 * kPi + 1e-9);
  }
  EXPECT_GE(nearest, 540);
  EXPECT_LE(farthest, 560);
  EXPECT_GT(farthest - nearest, 10);
  // Nothing of this is told to the solvers but r0.
  EXPECT_EQ(trial.photos.approx_distance_mm, 550);
  EXPECT_FALSE(trial.photos.aims[0].camera_from_lift);
  for (const Photo& photo : trial.photos.photos) {
    EXPECT_FALSE(photo.camera_from_table);
    EXPECT_FALSE(photo.turntable_rad);
  }
}

TEST(Fig12, MasksAreTheMeshSeenByTheTrueCameras) {
  const TriangleMesh mesh = test::BugMesh(1);
  const PoseTrial trial = MakeFig12Trial(mesh, Small());
  for (std::size_t i = 0; i < trial.masks.size(); ++i) {
    const cv::Mat other =
        test::RenderMask(mesh, trial.truth[i].camera_from_model, trial.truth[i].intrinsics)
            .coverage;
    ASSERT_EQ(trial.masks[i].coverage.size(), other.size());
    EXPECT_GT(cv::countNonZero(other), 500);
    EXPECT_LE(cv::norm(trial.masks[i].coverage, other, cv::NORM_INF), 24) << "of 255";
  }
}

TEST(Fig12, TheSeedAloneDecides) {
  const TriangleMesh mesh = test::BugMesh(0);
  const auto with_threads = [&](std::size_t threads, std::uint64_t seed) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    Fig12Options options = Small();
    options.seed = seed;
    return MakeFig12Trial(mesh, options);
  };
  const PoseTrial one = with_threads(1, 12), two = with_threads(2, 12), other = with_threads(2, 13);
  for (std::size_t i = 0; i < one.masks.size(); ++i) {
    EXPECT_EQ(cv::norm(one.masks[i].coverage, two.masks[i].coverage, cv::NORM_L1), 0);
    EXPECT_EQ(one.truth[i].camera_from_model.matrix34(), two.truth[i].camera_from_model.matrix34());
  }
  EXPECT_GT(cv::norm(one.masks[0].coverage, other.masks[0].coverage, cv::NORM_L1), 0);
}

TEST(Fig12, OutlinesCarryTheStatedErrors) {
  const TriangleMesh mesh = test::BugMesh(1);
  Fig12Options options = Small();
  options.cameras = 3;
  options.noise.bias_px = 0.5;
  const PoseTrial swollen = MakeFig12Trial(mesh, options);
  options.noise.sigma_px = 0.5;
  options.noise.binary = true;
  const PoseTrial strayed = MakeFig12Trial(mesh, options);
  options.noise = {};
  const PoseTrial clean = MakeFig12Trial(mesh, options);
  for (std::size_t i = 0; i < clean.masks.size(); ++i) {
    const PoseOf& camera = clean.truth[i];
    double length = 0;
    const auto outlines = TrueOutlines(mesh, camera.camera_from_model, camera.intrinsics);
    for (const Contour& contour : outlines) length += LengthOf(contour);
    EXPECT_LE(cv::norm(CoverageOfContours(outlines, clean.masks[i].coverage.size()),
                       clean.masks[i].coverage, cv::NORM_INF),
              24)
        << "of 255";
    const double grown =
        (cv::sum(swollen.masks[i].coverage)[0] - cv::sum(clean.masks[i].coverage)[0]) / 255;
    EXPECT_NEAR(grown, 0.5 * length, 0.1 * length);
    EXPECT_FALSE(swollen.masks[i].binary);
    EXPECT_TRUE(strayed.masks[i].binary);
    const cv::Mat& pixels = strayed.masks[i].coverage;
    EXPECT_EQ(cv::countNonZero(pixels), cv::countNonZero(pixels == 255));
    EXPECT_GT(cv::norm(pixels, swollen.masks[i].coverage, cv::NORM_INF), 100);
  }
}

TEST(SolveEachAlone, IsSolveJointOnEveryPhotograph) {
  const TriangleMesh mesh = test::BugMesh(1);
  Fig12Options protocol = Small();
  protocol.cameras = 2;
  const PoseTrial trial = MakeFig12Trial(mesh, protocol);
  JointOptions options;
  options.start.subdivisions = 2;
  options.start.angles = 36;
  const auto poses = SolveEachAlone(trial, options);
  ASSERT_TRUE(poses) << ToString(poses.error());
  ASSERT_EQ(poses->views.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(poses->views[i].name, trial.photos.photos[i].name);
    EXPECT_LT(DegFromRad(AngleBetween(poses->views[i].camera_from_model.rotation(),
                                      trial.truth[i].camera_from_model.rotation())),
              2)
        << i;
  }
  PhotoSet second = trial.photos;
  second.photos = {trial.photos.photos[1]};
  const auto alone = SolveJoint(mesh, second, {&trial.masks[1], 1}, options);
  ASSERT_TRUE(alone) << ToString(alone.error());
  EXPECT_EQ(alone->views[0].camera_from_model.matrix34(),
            poses->views[1].camera_from_model.matrix34());

  PoseTrial broken = trial;
  broken.masks[1].coverage.setTo(0);
  const auto refused = SolveEachAlone(broken, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace scan
