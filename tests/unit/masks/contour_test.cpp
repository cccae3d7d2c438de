#include "reconstruction/masks/contour.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/masks/coverage.h"

namespace scan {
namespace {

double CircleDistance(double x, double y, double cx, double cy, double r) {
  return std::hypot(x - cx, y - cy) - r;
}

TEST(Contour, CircleIsFoundToSubPixelWithoutBias) {
  for (const double radius : {12.3, 40.7, 90.0}) {
    Mask mask;
    mask.coverage = ToBytes(CoverageOf({240, 220}, [&](double x, double y) {
      return CircleDistance(x, y, 117.3, 109.6, radius);
    }));
    const auto contours = ExtractContours(mask);
    ASSERT_EQ(contours.size(), 1u);
    EXPECT_FALSE(contours[0].hole);
    const Contour even = Resampled(contours[0], 0.5);
    double sum = 0, squares = 0, worst_normal = 1;
    for (const ContourPoint& point : even.points) {
      const Eigen::Vector2d radial = point.position - Eigen::Vector2d(117.3, 109.6);
      const double error = radial.norm() - radius;
      sum += error;
      squares += error * error;
      worst_normal = std::min(worst_normal, radial.normalized().dot(point.normal));
      EXPECT_EQ(point.flags, 0);
    }
    const double n = static_cast<double>(even.points.size());
    EXPECT_NEAR(sum / n, 0, 0.01) << radius;
    EXPECT_LT(std::sqrt(squares / n), 0.05) << radius;
    EXPECT_GT(worst_normal, std::cos(0.12)) << radius;
    EXPECT_NEAR(LengthOf(contours[0]), 2 * M_PI * radius, 0.01 * 2 * M_PI * radius);
  }
}

TEST(Contour, HoleRunsTheOtherWayAndItsNormalPointsIntoIt) {
  Mask mask;
  mask.coverage = ToBytes(CoverageOf({120, 120}, [](double x, double y) {
    return std::max(CircleDistance(x, y, 60, 60, 45), 20 - std::hypot(x - 60, y - 60));
  }));
  const auto contours = ExtractContours(mask);
  ASSERT_EQ(contours.size(), 2u);
  EXPECT_FALSE(contours[0].hole);
  EXPECT_TRUE(contours[1].hole);
  for (const ContourPoint& point : contours[1].points) {
    EXPECT_LT(point.normal.dot(point.position - Eigen::Vector2d(60, 60)), 0);
  }
}

TEST(Contour, BinaryMaskGivesTheMidPixelStaircase) {
  Mask mask;
  mask.coverage = cv::Mat::zeros(20, 30, CV_8U);
  mask.coverage(cv::Rect(5, 6, 10, 8)) = 255;
  mask.binary = true;
  const auto contours = ExtractContours(mask);
  ASSERT_EQ(contours.size(), 1u);
  for (const ContourPoint& point : contours[0].points) {
    const double x = point.position.x(), y = point.position.y();
    const bool on_vertical = x == 5 || x == 15, on_horizontal = y == 6 || y == 14;
    EXPECT_TRUE(on_vertical != on_horizontal) << x << " " << y;
  }
}

TEST(Contour, DiagonalLegOfABinaryMaskStaysInOnePiece) {
  Mask mask;
  mask.coverage = cv::Mat::zeros(40, 40, CV_8U);
  for (int i = 5; i < 35; ++i) mask.coverage.at<uchar>(i, i) = 255;
  mask.binary = true;
  EXPECT_EQ(ExtractContours(mask).size(), 1u);
}

TEST(Contour, CutByTheBorderIsFlaggedAndClosed) {
  Mask mask;
  mask.coverage = ToBytes(
      CoverageOf({100, 80}, [](double x, double y) { return CircleDistance(x, y, 98, 40, 25); }));
  const auto contours = ExtractContours(mask);
  ASSERT_EQ(contours.size(), 1u);
  std::size_t cut = 0;
  for (const ContourPoint& point : contours[0].points) {
    EXPECT_EQ((point.flags & kContourCut) != 0, point.position.x() > 98);
    cut += (point.flags & kContourCut) != 0;
  }
  EXPECT_GT(cut, 40u);
  const Contour even = Resampled(contours[0], 1.0);
  for (std::size_t i = 0; i < even.points.size(); ++i) {
    const double step =
        (even.points[(i + 1) % even.points.size()].position - even.points[i].position).norm();
    EXPECT_LT(step, 1.1);
    EXPECT_GT(step, 0.6);  // a chord across a corner
  }
}

TEST(Contour, IgnoredRegionIsFlagged) {
  Mask mask;
  mask.coverage = ToBytes(
      CoverageOf({100, 100}, [](double x, double y) { return CircleDistance(x, y, 50, 50, 30); }));
  mask.ignore = cv::Mat::zeros(100, 100, CV_8U);
  mask.ignore.rowRange(70, 100) = 1;
  const auto contours = ExtractContours(mask);
  ASSERT_EQ(contours.size(), 1u);
  for (const ContourPoint& point : contours[0].points) {
    const bool ignored = (point.flags & kContourIgnored) != 0;
    EXPECT_TRUE(ignored || point.position.y() <= 70);
    EXPECT_TRUE(!ignored || point.position.y() >= 67);
  }
}

TEST(Contour, EmptyFullAndSpeckledMasks) {
  Mask mask;
  EXPECT_TRUE(ExtractContours(mask).empty());
  mask.coverage = cv::Mat::zeros(10, 10, CV_8U);
  mask.coverage.at<uchar>(5, 5) = 255;
  EXPECT_TRUE(ExtractContours(mask).empty());  // a speck
  mask.coverage = cv::Mat(10, 10, CV_8U, cv::Scalar(255));
  const auto contours = ExtractContours(mask);
  ASSERT_EQ(contours.size(), 1u);
  for (const ContourPoint& point : contours[0].points) EXPECT_TRUE(point.flags & kContourCut);
}

}  // namespace
}  // namespace scan
