#include "reconstruction/report/pose_pictures.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "drivers/base/units.h"
#include "reconstruction/pose/contour_evidence.h"

namespace scan {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

TriangleMesh Box(double half_mm) {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i)
    mesh.vertices.push_back(half_mm * Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1));
  for (const Face& f :
       {Face{0, 2, 1}, Face{1, 2, 3}, Face{4, 5, 6}, Face{5, 7, 6}, Face{0, 1, 4}, Face{1, 5, 4},
        Face{2, 6, 3}, Face{3, 6, 7}, Face{0, 4, 2}, Face{2, 4, 6}, Face{1, 3, 5}, Face{3, 7, 5}})
    mesh.faces.push_back(f);
  return mesh;
}

std::vector<RingCamera> Ring(int count, const Vector3d& off_by) {
  std::vector<RingCamera> cameras;
  for (int i = 0; i < count; ++i) {
    const double angle = 2 * kPi * i / count;
    RingCamera camera;
    camera.label = std::to_string(i + 1);
    camera.nominal = 100 * Vector3d(std::cos(angle), std::sin(angle), 0.2);
    camera.solved = *camera.nominal + off_by;
    camera.forward = -camera.solved->normalized();
    camera.accepted = i != 0;
    cameras.push_back(camera);
  }
  return cameras;
}

cv::Vec3b At(const cv::Mat& picture, const Vector2d& px) {
  return picture.at<cv::Vec3b>(static_cast<int>(px.y()), static_cast<int>(px.x()));
}

// BGR.
bool Green(const cv::Vec3b& c) { return c[1] > c[0] + 40 && c[1] > c[2] + 40; }
bool Red(const cv::Vec3b& c) { return c[2] > c[0] + 80 && c[2] > c[1] + 80; }

double Difference(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF); }

TEST(RoundFactor, IsTheNextOneTwoOrFiveBelow) {
  EXPECT_DOUBLE_EQ(RoundFactor(1), 1);
  EXPECT_DOUBLE_EQ(RoundFactor(1.9), 1);
  EXPECT_DOUBLE_EQ(RoundFactor(49), 20);
  EXPECT_DOUBLE_EQ(RoundFactor(51), 50);
  EXPECT_DOUBLE_EQ(RoundFactor(0.03), 0.02);
  EXPECT_DOUBLE_EQ(RoundFactor(0), 1);
  EXPECT_DOUBLE_EQ(RoundFactor(kNan), 1);
}

TEST(RingPicture, MarksStandWhereTheViewSaysEnlargedFromTheLoggedOnes) {
  const Vector3d off_by(0.5, 0, 0);
  const auto cameras = Ring(6, off_by);
  const RingPicture ring = DrawRing(cameras, Box(10), {}, Vector3d::UnitZ(), 700);
  ASSERT_FALSE(ring.picture.empty());
  EXPECT_EQ(ring.picture.cols, 700);
  // A twentieth of the radius of about 100 mm over 0.5 mm: ten times.
  EXPECT_DOUBLE_EQ(ring.enlarged, 10);
  for (const RingCamera& camera : cameras) {
    const Vector2d at = ring.view(*camera.nominal + ring.enlarged * off_by);
    ASSERT_TRUE((at.array() >= 3).all() && at.x() < 697 && at.y() < ring.picture.rows - 3);
    const cv::Vec3b colour = At(ring.picture, at);
    EXPECT_TRUE(camera.accepted ? Green(colour) : Red(colour)) << camera.label;
  }
  // Up is up, and the ring is wider than high: it is seen from obliquely above.
  EXPECT_LT(ring.view(Vector3d(0, 0, 10)).y(), ring.view(Vector3d::Zero()).y());
  EXPECT_LT(ring.picture.rows, ring.picture.cols);
  EXPECT_GT(ring.view.right.cross(ring.view.up).dot(Vector3d::UnitZ()), 0.3);
}

TEST(RingPicture, NothingIsDrawnOfNothingAndNothingOfWhatIsNotFinite) {
  EXPECT_TRUE(DrawRing({}, Box(10), {}, Vector3d::UnitZ(), 700).picture.empty());
  const auto cameras = Ring(5, Vector3d(0.3, 0.1, 0));
  const RingPicture clean = DrawRing(cameras, Box(10), {}, Vector3d::UnitZ(), 500);

  auto spoilt = cameras;
  RingCamera bad = cameras[0];
  bad.solved = Vector3d(kNan, 0, 0);
  spoilt.push_back(bad);
  bad = cameras[1];
  bad.forward.setConstant(kNan);
  spoilt.push_back(bad);
  TriangleMesh mesh = Box(10);
  mesh.vertices.push_back(Vector3d::Constant(kNan));
  FreeDirection direction;
  direction.point.setConstant(kNan);
  const RingPicture drawn = DrawRing(spoilt, mesh, {&direction, 1}, Vector3d::UnitZ(), 500);
  ASSERT_EQ(drawn.picture.size(), clean.picture.size());
  EXPECT_EQ(Difference(drawn.picture, clean.picture), 0);
  EXPECT_TRUE(DrawRing(cameras, Box(10), {}, Vector3d::Constant(kNan), 500).picture.empty());
}

TEST(RingPicture, AFreeRotationIsSeenOnItsAxis) {
  const auto cameras = Ring(5, Vector3d::Zero());
  const RingPicture without = DrawRing(cameras, Box(10), {}, Vector3d::UnitZ(), 500);
  EXPECT_DOUBLE_EQ(without.enlarged, 1);
  FreeDirection direction;  // about z through the origin
  const RingPicture with = DrawRing(cameras, Box(10), {&direction, 1}, Vector3d::UnitZ(), 500);
  ASSERT_EQ(with.picture.size(), without.picture.size());
  EXPECT_GT(Difference(with.picture, without.picture), 50);
  direction.kind = FreeDirection::Kind::scale;
  const RingPicture scale = DrawRing(cameras, Box(10), {&direction, 1}, Vector3d::UnitZ(), 500);
  EXPECT_EQ(Difference(scale.picture, without.picture), 0);
}

struct Seen {
  Intrinsics intrinsics{.w = 600, .h = 400, .fl_x = 1000, .fl_y = 1000, .cx = 300, .cy = 200};
  ViewPose view;
  Seen() {
    view.camera_from_model =
        CameraFromModel(Eigen::Matrix3d(Vector3d(1, -1, -1).asDiagonal()), Vector3d(0, 0, 200));
  }
};

TEST(SurfaceEllipses, AreThePictureOfThePosesCovariance) {
  Seen seen;
  // 0.1 mm along the picture's rows at 190 to 210 mm: about 0.5 px.
  seen.view.covariance(3, 3) = 0.01;
  const auto ellipses = SurfaceEllipses(Box(10), seen.view, seen.intrinsics, 6);
  ASSERT_GE(ellipses.size(), 16u);
  for (const SurfaceEllipse& e : ellipses) {
    EXPECT_NEAR(std::sqrt(e.covariance_px2(0, 0)), 1000 * 0.1 / 190, 1e-3);
    EXPECT_NEAR(e.covariance_px2(1, 1), 0, 1e-9);
    EXPECT_LT((e.centre_px - Vector2d(300, 200)).cwiseAbs().maxCoeff(), 1000 * 10 / 190.0 + 3);
  }
  // Focal length of 1 %: outward, in proportion to the distance from the principal point.
  seen.view.covariance_with_lens = Eigen::MatrixXd::Zero(kEvidenceSize, kEvidenceSize);
  seen.view.covariance_with_lens(6, 6) = 1e-4;
  for (const SurfaceEllipse& e : SurfaceEllipses(Box(10), seen.view, seen.intrinsics, 6)) {
    const Vector2d outward = 0.01 * (e.centre_px - Vector2d(300, 200));
    EXPECT_LT((e.covariance_px2 - outward * outward.transpose()).norm(), 1e-4);
  }
}

TEST(SurfaceEllipses, NothingOfNoPoseNoSurfaceAndOfWhatIsNotFinite) {
  Seen seen;
  EXPECT_TRUE(SurfaceEllipses({}, seen.view, seen.intrinsics, 6).empty());
  EXPECT_TRUE(SurfaceEllipses(Box(10), ViewPose(), seen.intrinsics, 6).empty());
  seen.view.covariance.setConstant(kNan);
  EXPECT_TRUE(SurfaceEllipses(Box(10), seen.view, seen.intrinsics, 6).empty());
  EXPECT_DOUBLE_EQ(EllipseFactor({}, 10), 1);
}

TEST(DrawEllipses, HalfAxesAreDrawnTheFactorTimesAsLong) {
  const SurfaceEllipse ellipse{Vector2d(100.5, 80.5), Vector2d(0.04, 0.01).asDiagonal()};
  const double factor = EllipseFactor({&ellipse, 1}, 20);
  EXPECT_DOUBLE_EQ(factor, 100);
  const cv::Mat blank(160, 200, CV_8UC3, cv::Scalar::all(0));
  const cv::Mat drawn = DrawEllipses(blank, {&ellipse, 1}, factor);
  cv::Mat inked;
  cv::extractChannel(drawn, inked, 2);
  const cv::Rect box = cv::boundingRect(inked > 100);
  EXPECT_NEAR(box.width, 41, 2);
  EXPECT_NEAR(box.height, 21, 2);
  EXPECT_NEAR(box.x + box.width / 2.0, 100.5, 1);
  const SurfaceEllipse bad{Vector2d(kNan, 80), Vector2d(1, 1).asDiagonal()};
  EXPECT_EQ(Difference(DrawEllipses(blank, {&bad, 1}, 1), blank), 0);
}

}  // namespace
}  // namespace scan
