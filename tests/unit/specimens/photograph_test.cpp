#include "reconstruction/specimens/photograph.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstring>

namespace scan {
namespace {

using Eigen::Vector3d;

// A ball of one colour: what the picture shows is known in closed form.
class Ball final : public Specimen {
 public:
  std::string_view name() const override { return "ball"; }
  double SignedDistance(const Vector3d& p) const override { return p.norm() - 10; }
  Vector3d Albedo(const Vector3d& p) const override {
    return p.x() > 0 ? Vector3d(0.6, 0.1, 0.05) : Vector3d(0.1, 0.5, 0.05);
  }
  double Density(const Vector3d& p) const override { return p.norm() < 10 ? 1 : 0; }
  BoundingBox Bounds() const override { return {Vector3d::Constant(-10), Vector3d::Constant(10)}; }
};

Intrinsics Camera() {
  Intrinsics in;
  in.w = 320;
  in.h = 240;
  in.fl_x = in.fl_y = 2000;
  in.cx = 161.3;
  in.cy = 118.9;
  return in;
}

const CameraFromModel kAhead(Eigen::Matrix3d::Identity(), Vector3d(0, 0, 250));

PhotographScene EvenScene() {
  PhotographOptions options;
  options.edge_mm = 0.3;
  options.shading = 0;
  options.vignetting = 0;
  return MakePhotographScene(std::make_shared<Ball>(), options);
}

double LinearOf(int srgb) {
  const double v = srgb / 255.0;
  return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
}

bool SameBytes(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

TEST(Photograph, ShowsTheAlbedoWhereTheSpecimenIsAndThePlateElsewhere) {
  const PhotographScene scene = EvenScene();
  const cv::Mat picture = RenderPhotograph(scene, kAhead, Camera());
  PhotographConditions away;
  away.specimen_present = false;
  const cv::Mat plate = RenderPhotograph(scene, kAhead, Camera(), away);
  const cv::Mat coverage = TrueCoverage(scene, kAhead, Camera());
  int inside = 0, outside = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const auto pixel = picture.at<cv::Vec3b>(y, x);
      const int share = coverage.at<std::uint8_t>(y, x);
      if (share == 0) {
        ++outside;
        ASSERT_EQ(pixel, plate.at<cv::Vec3b>(y, x));
      }
      if (share == 255 && std::abs(x + 0.5 - Camera().cx) > 2) {
        ++inside;
        const Vector3d albedo = Ball().Albedo({x + 0.5 - Camera().cx, 0, 0});
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(LinearOf(pixel[2 - c]), 0.9 * albedo[c], 0.004) << x << ' ' << y;
        }
      }
    }
  }
  EXPECT_GT(inside, 15000);
  EXPECT_GT(outside, 15000);
}

TEST(Photograph, OutlineBlendsByTheExactCoverage) {
  const PhotographScene scene = EvenScene();
  const cv::Mat picture = RenderPhotograph(scene, kAhead, Camera());
  PhotographConditions away;
  away.specimen_present = false;
  const cv::Mat plate = RenderPhotograph(scene, kAhead, Camera(), away);
  const cv::Mat coverage = TrueCoverage(scene, kAhead, Camera());
  int edges = 0;
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const double share = coverage.at<std::uint8_t>(y, x) / 255.0;
      if (share == 0 || share == 1 || std::abs(x + 0.5 - Camera().cx) < 3) continue;
      ++edges;
      // Blue differs most between specimen and background.
      const double behind = LinearOf(plate.at<cv::Vec3b>(y, x)[0]);
      const double blue = LinearOf(picture.at<cv::Vec3b>(y, x)[0]);
      EXPECT_NEAR((behind - blue) / (behind - 0.9 * 0.05), share, 0.015);
    }
  }
  EXPECT_GT(edges, 200);
  // The outline of a ball is a circle: its area, summed over the shares.
  const double radius_px = 2000 * 10 / std::sqrt(250.0 * 250 - 100);
  EXPECT_NEAR(cv::sum(coverage)[0] / 255 / (3.14159265 * radius_px * radius_px), 1, 2e-3);
}

TEST(Photograph, LightOffIsNearlyBlackAndExposureScales) {
  const PhotographScene scene = EvenScene();
  PhotographConditions dark;
  dark.light_on = false;
  EXPECT_LT(cv::mean(RenderPhotograph(scene, kAhead, Camera(), dark))[1], 12);
  PhotographConditions half;
  half.exposure = 0.5;
  const cv::Mat bright = RenderPhotograph(scene, kAhead, Camera());
  const cv::Mat dim = RenderPhotograph(scene, kAhead, Camera(), half);
  EXPECT_NEAR(LinearOf(dim.at<cv::Vec3b>(5, 5)[1]) / LinearOf(bright.at<cv::Vec3b>(5, 5)[1]), 0.5,
              0.02);
}

TEST(Photograph, SameBytesForAnyNumberOfThreads) {
  const PhotographScene scene = EvenScene();
  Intrinsics in = Camera();
  in.k1 = -0.1;
  cv::Mat one, two;
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 1);
    one = RenderPhotograph(scene, kAhead, in);
  }
  {
    tbb::global_control limit(tbb::global_control::max_allowed_parallelism, 2);
    two = RenderPhotograph(scene, kAhead, in);
  }
  EXPECT_TRUE(SameBytes(one, two));
}

}  // namespace
}  // namespace scan
