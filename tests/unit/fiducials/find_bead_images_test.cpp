#include "reconstruction/fiducials/find_bead_images.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "drivers/base/rng.h"

namespace scan {
namespace {

int Code(double linear) {
  const double s = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<int>(std::lround(255 * std::min(1.0, std::max(0.0, s))));
}

struct Disc {
  Eigen::Vector2d centre{30, 30};
  double radius_px = 5;
  double flat_px = 0;  // cut off to the left of the centre plus this, when not zero
};

// A blue ball, lit from the left, before a red half and a grey half.
cv::Mat Picture(const Disc& disc, bool highlight = false) {
  constexpr int kSize = 60, kSub = 8;
  cv::Mat picture(kSize, kSize, CV_8UC3);
  Rng rng(5);
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      Eigen::Vector3d sum = Eigen::Vector3d::Zero();
      for (int s = 0; s < kSub * kSub; ++s) {
        const Eigen::Vector2d p(x + (s % kSub + 0.5) / kSub, y + (s / kSub + 0.5) / kSub);
        const Eigen::Vector2d from = (p - disc.centre) / disc.radius_px;
        Eigen::Vector3d rgb =
            p.y() < 33 ? Eigen::Vector3d(0.5, 0.04, 0.03) : Eigen::Vector3d(0.3, 0.33, 0.4);
        if (from.norm() < 1 && (disc.flat_px == 0 || p.x() > disc.centre.x() - disc.flat_px)) {
          rgb = (0.8 - 0.15 * from.x()) * Eigen::Vector3d(0.01, 0.12, 0.9);
          if (highlight && (from - Eigen::Vector2d(-0.3, -0.3)).norm() < 0.25)
            rgb = Eigen::Vector3d(0.95, 0.95, 0.95);
        }
        sum += rgb / (kSub * kSub);
      }
      sum *= 1 + 0.01 * rng.Normal();
      picture.at<cv::Vec3b>(y, x) = {static_cast<uchar>(Code(sum[2])),
                                     static_cast<uchar>(Code(sum[1])),
                                     static_cast<uchar>(Code(sum[0]))};
    }
  return picture;
}

BeadColourOptions Blue() {
  BeadColourOptions options;
  options.colour = ParseBeadColour("#0060ff").value();
  return options;
}

TEST(FindBeadImages, CentresAreFoundToATenthOfAPixel) {
  for (const double radius : {2.6, 5.0, 9.0}) {
    for (int trial = 0; trial < 6; ++trial) {
      const Disc disc{{29.2 + 0.17 * trial, 30.4 + 0.31 * trial}, radius};
      for (const bool highlight : {false, true}) {
        if (highlight && radius < 4) continue;
        const auto images = FindBeadImages(Picture(disc, highlight), Blue());
        ASSERT_EQ(images.size(), 1u);
        EXPECT_LT((images[0].centre - disc.centre).norm(), 0.1) << radius << ' ' << trial;
        EXPECT_NEAR(images[0].area_px / (CV_PI * radius * radius), 1, 0.12) << radius;
        EXPECT_NEAR(images[0].semi_axes_px.mean() / radius, 1, 0.08);
        EXPECT_FALSE(images[0].cut);
      }
    }
  }
}

TEST(FindBeadImages, WhatIsHiddenIsMissing) {
  const Disc whole{{30, 30}, 6}, half{{30, 30}, 6, 0.01};
  const auto all = FindBeadImages(Picture(whole), Blue());
  const auto some = FindBeadImages(Picture(half), Blue());
  ASSERT_EQ(some.size(), 1u);
  EXPECT_NEAR(some[0].area_px / all[0].area_px, 0.5, 0.06);
  EXPECT_NEAR(some[0].centre.x(), 30 + 4 / (3 * CV_PI) * 6, 0.15);  // centroid of a half disc
  EXPECT_LT(some[0].semi_axes_px[1], 0.65 * some[0].semi_axes_px[0]);
}

TEST(FindBeadImages, KnowsWhatTheBorderCuts) {
  const auto images = FindBeadImages(Picture({{2, 30}, 5}), Blue());
  ASSERT_EQ(images.size(), 1u);
  EXPECT_TRUE(images[0].cut);
}

TEST(FindBeadImages, OtherColoursAndDarknessAreNoBeads) {
  EXPECT_TRUE(FindBeadImages(Picture({{-50, 0}, 5}), Blue()).empty());
  EXPECT_TRUE(FindBeadImages(cv::Mat(40, 40, CV_8UC3, cv::Scalar(9, 0, 0)), Blue()).empty());
}

TEST(ParseBeadColour, RefusesWhatIsNoStrongColour) {
  EXPECT_TRUE(ParseBeadColour("#00ff00"));
  for (const char* text : {"", "blue", "#12345", "#12345g", "#808080", "#000000", "#ffffff"})
    EXPECT_FALSE(ParseBeadColour(text)) << text;
}

}  // namespace
}  // namespace scan
