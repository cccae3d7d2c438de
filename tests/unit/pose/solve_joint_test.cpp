#include "reconstruction/pose/solve_joint.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>
#include <opencv2/imgproc.hpp>

#include "pose_scene.h"
#include "reconstruction/pose/lens_distortion.h"
#include "reconstruction/pose/score.h"

namespace scan {
namespace {

const test::SceneOptions kSmall{.w = 924, .h = 612, .views = 8};

TableFromModel SomePlacing() {
  return TableFromModel(ExpSo3({0.05, -0.1, 1.9}), Eigen::Vector3d(1.5, -2, 3));
}

JointOptions NearPlacing() {
  Vector6d off;
  off << 0.01, -0.01, 0.02, 0.2, -0.3, 0.3;
  JointOptions options;
  options.table_from_model["m0"] = MovedAbout(SomePlacing(), off, Eigen::Vector3d::Zero());
  return options;
}

PoseError ErrorOf(const TriangleMesh& mesh, const test::Scene& scene, const Poses& poses,
                  std::size_t i) {
  return ScorePose(mesh, {scene.truth[i], scene.true_intrinsics[i]},
                   {poses.views[i].camera_from_model,
                    poses.lens_states.at(poses.views[i].lens_state).intrinsics});
}

TEST(SolveJoint, StaticRigErrorsFromNominalPoses) {
  const TriangleMesh mesh = test::BugMesh(3);
  test::SceneOptions options = kSmall;
  options.static_errors = true;
  const test::Scene scene = test::MakeScene(mesh, SomePlacing(), options);
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, NearPlacing());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    const PoseError error = ErrorOf(mesh, scene, *poses, i);
    EXPECT_LT(error.centre_mm, 1.0) << view.name;
    EXPECT_LT(error.surface_median_px, 0.1) << view.name;
    EXPECT_TRUE(view.covariance.allFinite());
    EXPECT_GT(view.surface_sigma_px.median, 0);
  }
}

TEST(SolveJoint, TheBiasOfDilatedMasksIsFound) {
  const TriangleMesh mesh = test::BugMesh(3);
  test::Scene scene = test::MakeScene(mesh, SomePlacing(), kSmall);
  for (Mask& mask : scene.masks) {
    // A box of 3 x 3 on an anti-aliased edge moves it by 1 px along the axes, more on diagonals.
    cv::Mat wide;
    cv::dilate(mask.coverage, wide, cv::Mat());
    mask.coverage = wide;
  }
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, NearPlacing());
  ASSERT_TRUE(poses) << ToString(poses.error());
  const SharedEstimate bias = poses->nuisances.at("mask_bias_px");
  EXPECT_GT(bias.value, 0.9);
  EXPECT_LT(bias.value, 1.5);
}

// A lens whose distortion is not as stated, the specimen filling its picture: seen, and so freed.
TEST(SolveJoint, DistortionThatTheOutlinesShowIsFound) {
  const TriangleMesh mesh = test::BugMesh(3);
  test::SceneOptions options = kSmall;
  options.focal_mm = 260;
  options.views = 24;
  test::Scene scene = test::MakeScene(mesh, SomePlacing(), options);
  for (LensState& lens : scene.photos.lens_states) lens.sigma.fl_rel = 0.01;
  constexpr double kAtCorner = 0.004;
  double k1 = 0;
  for (std::size_t i = 0; i < scene.masks.size(); ++i) {
    Intrinsics& in = scene.true_intrinsics[i];
    k1 = in.k1 = kAtCorner * K1OfCorner(in);
    scene.masks[i] = test::RenderMask(mesh, scene.truth[i], in);
  }
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, NearPlacing());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (const auto& [id, lens] : poses->lens_states) {
    const SharedEstimate& found = lens.parameters.at("k1");
    EXPECT_LT(found.sigma, 0.5 * found.prior_sigma) << id;
    EXPECT_NEAR(found.value, k1, 0.2 * k1) << id;
    EXPECT_EQ(lens.intrinsics.k1, found.value) << id;
  }
  for (std::size_t i = 0; i < poses->views.size(); ++i)
    EXPECT_LT(ErrorOf(mesh, scene, *poses, i).surface_median_px, 0.3) << i;
}

TEST(SolveJoint, SameBytesForAnyNumberOfThreads) {
  const TriangleMesh mesh = test::BugMesh(2);
  test::SceneOptions options = kSmall;
  options.views = 4;
  options.static_errors = true;
  const test::Scene scene = test::MakeScene(mesh, SomePlacing(), options);
  const auto solve = [&](std::size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return SolveJoint(mesh, scene.photos, scene.masks, NearPlacing());
  };
  const auto one = solve(1), two = solve(2);
  ASSERT_TRUE(one && two);
  for (std::size_t i = 0; i < one->views.size(); ++i) {
    EXPECT_EQ(one->views[i].camera_from_model.matrix34(),
              two->views[i].camera_from_model.matrix34());
    EXPECT_EQ(one->views[i].covariance, two->views[i].covariance);
  }
}

TEST(SolveJoint, OneEmptyMaskRejectsItsViewOnly) {
  const TriangleMesh mesh = test::BugMesh(2);
  test::Scene scene = test::MakeScene(mesh, SomePlacing(), kSmall);
  scene.masks[3].coverage.setTo(0);
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, NearPlacing());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i)
    EXPECT_EQ(poses->views[i].status == ViewStatus::rejected, i == 3) << poses->views[i].reason;
  EXPECT_NE(poses->views[3].reason.find("empty"), std::string::npos);
  // Its pose is still what the rig says.
  EXPECT_LT(ErrorOf(mesh, scene, *poses, 3).surface_median_px, 3);
}

TEST(SolveJoint, AMaskOfAnotherViewIsRejectedAndDoesNotSpread) {
  const TriangleMesh mesh = test::BugMesh(2);
  test::Scene scene = test::MakeScene(mesh, SomePlacing(), kSmall);
  scene.masks[2] = scene.masks[7];
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, NearPlacing());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    EXPECT_EQ(poses->views[i].status == ViewStatus::rejected, i == 2)
        << i << poses->views[i].reason;
    EXPECT_LT(ErrorOf(mesh, scene, *poses, i).surface_median_px, i == 2 ? 3 : 0.2) << i;
  }
}

void ExpectRefused(const TriangleMesh& mesh, const PhotoSet& photos, const std::vector<Mask>& masks,
                   const std::string& word) {
  const auto poses = SolveJoint(mesh, photos, masks, NearPlacing());
  ASSERT_FALSE(poses) << word;
  EXPECT_EQ(poses.error().kind, ErrorKind::bad_input);
  EXPECT_NE(ToString(poses.error()).find(word), std::string::npos) << ToString(poses.error());
}

TEST(SolveJoint, BadInputIsRefusedWithAReason) {
  const TriangleMesh mesh = test::BugMesh(0);
  test::SceneOptions options = kSmall;
  options.w = 200;
  options.h = 150;
  options.views = 2;
  const test::Scene scene = test::MakeScene(mesh, SomePlacing(), options);
  TriangleMesh broken = mesh;
  broken.faces.clear();
  ExpectRefused(broken, scene.photos, scene.masks, "no faces");
  broken = mesh;
  broken.vertices[7].y() = std::numeric_limits<double>::quiet_NaN();
  ExpectRefused(broken, scene.photos, scene.masks, "not a number");
  broken = mesh;
  broken.faces[3][1] = 1000000;
  ExpectRefused(broken, scene.photos, scene.masks, "does not exist");
  ExpectRefused(mesh, PhotoSet{}, {}, "no photographs");
  std::vector<Mask> masks = scene.masks;
  masks.pop_back();
  ExpectRefused(mesh, scene.photos, masks, "1 masks for 2 photographs");
  masks = scene.masks;
  masks[1].coverage = cv::Mat(10, 10, CV_8U, cv::Scalar(0));
  ExpectRefused(mesh, scene.photos, masks, "10 x 10");
  masks = scene.masks;
  for (Mask& mask : masks) mask.coverage.setTo(0);
  ExpectRefused(mesh, scene.photos, masks, "shows a specimen");
}

TEST(SolveJoint, StopsWhenAsked) {
  const TriangleMesh mesh = test::BugMesh(1);
  const test::Scene scene = test::MakeScene(mesh, SomePlacing(), kSmall);
  std::stop_source source;
  source.request_stop();
  const auto poses =
      SolveJoint(mesh, scene.photos, scene.masks, NearPlacing(), {}, source.get_token());
  ASSERT_FALSE(poses);
  EXPECT_EQ(poses.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace scan
