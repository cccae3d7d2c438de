#include "reconstruction/pose/covered_spans.h"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "drivers/base/rng.h"
#include "reconstruction/pose/silhouette_raster.h"

namespace scan {
namespace {

using Triangle = std::array<Eigen::Vector2d, 3>;

// Every edge of every triangle, with the side its third corner is on.
CoveredSpans SpansOf(const std::vector<Triangle>& triangles, int w, int h) {
  CoveredSpans spans(w, h);
  for (const Triangle& t : triangles) {
    const Eigen::Vector2d ab = t[1] - t[0], ac = t[2] - t[0];
    const double cross = ab.x() * ac.y() - ab.y() * ac.x();
    for (std::size_t k = 0; k < 3; ++k) spans.AddEdge(t[k], t[(k + 1) % 3], cross > 0 ? 1 : -1);
  }
  spans.Finish();
  return spans;
}

// The plain way: every triangle filled.
cv::Mat Filled(const std::vector<Triangle>& triangles, int w, int h) {
  std::vector<Eigen::Vector2f> pixels;
  std::vector<Face> faces;
  for (const Triangle& t : triangles) {
    const auto first = static_cast<std::uint32_t>(pixels.size());
    for (const Eigen::Vector2d& p : t) pixels.push_back(p.cast<float>());
    faces.push_back({first, first + 1, first + 2});
  }
  cv::Mat mask(h, w, CV_8U, cv::Scalar(0));
  FillTriangles(pixels, faces, mask);
  return mask;
}

TEST(CoveredSpans, CoverWhatFilledTrianglesCover) {
  constexpr int kW = 60, kH = 40;
  Rng rng(5);
  for (int round = 0; round < 50; ++round) {
    std::vector<Triangle> triangles(static_cast<std::size_t>(1 + round / 5));
    for (Triangle& t : triangles)  // also far outside of the picture
      for (Eigen::Vector2d& p : t)
        p = {kW * (2 * rng.Uniform() - 0.5), kH * (2 * rng.Uniform() - 0.5)};
    const CoveredSpans spans = SpansOf(triangles, kW, kH);
    const cv::Mat filled = Filled(triangles, kW, kH);
    int different = 0;
    for (int y = 0; y < kH; ++y)
      for (int x = 0; x < kW; ++x)
        different += spans.Covered({x + 0.5, y + 0.5}) != (filled.at<uchar>(y, x) != 0);
    EXPECT_EQ(different, 0) << "round " << round;
  }
}

TEST(CoveredSpans, NothingIsCoveredOutsideOfThePicture) {
  const CoveredSpans spans = SpansOf({{{{-1e9, -1e9}, {1e9, -1e9}, {0, 1e9}}}}, 20, 10);
  for (int y = 0; y < 10; ++y) EXPECT_TRUE(spans.Covered({19.9, y + 0.1}));
  EXPECT_FALSE(spans.Covered({20, 5}));
  EXPECT_FALSE(spans.Covered({-0.1, 5}));
  EXPECT_FALSE(spans.Covered({5, 10}));
  EXPECT_FALSE(spans.Covered({5, std::numeric_limits<double>::quiet_NaN()}));
  CoveredSpans none(20, 10);
  none.Finish();
  EXPECT_FALSE(none.Covered({5, 5}));
}

}  // namespace
}  // namespace scan
