// What is not the specimen, or not as stated, is rejected with the reason: never a confident wrong
// pose.
#include <gtest/gtest.h>

#include <opencv2/imgproc.hpp>

#include "reconstruction/pose/rigid_motion.h"
#include "reconstruction/pose/score.h"
#include "reconstruction/pose/solve_joint.h"
#include "tests/unit/pose/pose_scene.h"

namespace scan {
namespace {

test::Scene EightViews(const TriangleMesh& mesh) {
  return test::MakeScene(mesh, TableFromModel(ExpSo3({0.1, 0.2, 0.5}), Eigen::Vector3d(2, 1, 3)),
                         test::MediumPhotos(8));
}

JointOptions FewerDirections() {
  JointOptions options;
  options.start.subdivisions = 3;
  return options;
}

void ExpectAllRejected(const Result<Poses>& poses, const std::string& what,
                       const std::string& word) {
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (const ViewPose& view : poses->views) {
    EXPECT_EQ(view.status, ViewStatus::rejected) << what << ": " << view.name;
    EXPECT_NE(view.reason.find(word), std::string::npos) << what << ": " << view.reason;
  }
}

TEST(WrongInput, AMeshOfAnotherScale) {
  const test::Scene scene = EightViews(test::BugMesh(2));
  for (const double scale : {0.7, 0.93, 1.1, 1.15, 2.0}) {
    TriangleMesh mesh = test::BugMesh(2);
    for (auto& v : mesh.vertices) v *= scale;
    ExpectAllRejected(SolveJoint(mesh, scene.photos, scene.masks, FewerDirections()),
                      "scale " + std::to_string(scale),
                      scale == 1.1 ? "times the mesh's size" : "outline");
  }
}

// Photographs without logged poses, which each look much like the mirror image's from behind.
Result<Poses> MirroredWithoutPoses(int w, bool mirror) {
  const TriangleMesh mesh = test::BugMesh(2);
  test::SceneOptions options;
  options.w = w;
  options.h = static_cast<int>(std::lround(w * 612.0 / 924));
  options.views = 4;
  const test::Scene scene = test::MakeScene(
      mesh, TableFromModel(ExpSo3({0.1, 0.2, 0.5}), Eigen::Vector3d(2, 1, 3)), options);
  TriangleMesh given = mesh;
  if (mirror) {
    for (auto& v : given.vertices) v.y() = -v.y();
    for (auto& f : given.faces) std::swap(f[1], f[2]);
  }
  JointOptions joint = FewerDirections();
  joint.no_priors = true;
  return SolveJoint(given, scene.photos, scene.masks, joint);
}

TEST(WrongInput, AMirroredMeshWithoutLoggedPoses) {
  for (const int w : {462, 1848, 3696})
    ExpectAllRejected(MirroredWithoutPoses(w, true), "mirrored, " + std::to_string(w),
                      "mirror image");
  for (const int w : {462, 1848}) {
    const auto poses = MirroredWithoutPoses(w, false);
    ASSERT_TRUE(poses) << ToString(poses.error());
    for (const ViewPose& view : poses->views)
      EXPECT_EQ(view.status, ViewStatus::accepted) << view.reason;
  }
}

TEST(WrongInput, AFocalLengthTwiceOrHalfOfTheTrueOne) {
  const TriangleMesh mesh = test::BugMesh(2);
  for (const double factor : {0.5, 2.0}) {
    test::Scene scene = EightViews(mesh);
    for (auto& lens : scene.photos.lens_states) {
      lens.intrinsics.fl_x *= factor;
      lens.intrinsics.fl_y *= factor;
    }
    ExpectAllRejected(SolveJoint(mesh, scene.photos, scene.masks, FewerDirections()),
                      "focal length x " + std::to_string(factor), "outline");
  }
}

TEST(WrongInput, PhotographsOfAnotherObject) {
  const test::Scene scene = EightViews(test::RevolutionMesh(60, {0, 0, 1}));
  ExpectAllRejected(SolveJoint(test::BugMesh(2), scene.photos, scene.masks, FewerDirections()),
                    "other object", "the mask shows something else");
}

// Of one aim's pictures the left border runs through the specimen: the border is no outline, and
// what the picture shows of the specimen tells where it is.
TEST(WrongInput, PicturesThatEndWithinTheSpecimen) {
  const TriangleMesh mesh = test::BugMesh(2);
  test::Scene scene = EightViews(mesh);
  constexpr int kCut = 440;
  scene.photos.lens_states[1].intrinsics.cx -= kCut;
  for (std::size_t i = 0; i < scene.masks.size(); ++i) {
    if (scene.photos.photos[i].aim != 1) continue;
    scene.true_intrinsics[i].cx -= kCut;
    const cv::Mat whole = scene.masks[i].coverage;
    cv::Mat& cut = scene.masks[i].coverage = cv::Mat(whole.size(), CV_8U, cv::Scalar(0));
    whole.colRange(kCut, whole.cols).copyTo(cut.colRange(0, whole.cols - kCut));
    ASSERT_GT(cv::countNonZero(cut.col(0)), 0) << "not cut";
  }
  const auto poses = SolveJoint(mesh, scene.photos, scene.masks, FewerDirections());
  ASSERT_TRUE(poses) << ToString(poses.error());
  for (std::size_t i = 0; i < poses->views.size(); ++i) {
    const ViewPose& view = poses->views[i];
    EXPECT_EQ(view.status, ViewStatus::accepted) << view.name << ": " << view.reason;
    const Intrinsics& in = scene.photos.intrinsics(scene.photos.photos[i]);
    EXPECT_LT(ScorePose(mesh, {scene.truth[i], scene.true_intrinsics[i]},
                        {view.camera_from_model, IntrinsicsOf(*poses, view, in)})
                  .surface_rms_px,
              0.2)
        << view.name;
  }
}

}  // namespace
}  // namespace scan
