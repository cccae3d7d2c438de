// Exact area coverage of simple shapes, the truth of the mask tests.
#pragma once

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

namespace scan {

// Share of each pixel inside `signed_distance` (negative inside, pixels, top-left pixel centre at
// (0.5, 0.5)), from 16 x 16 samples where the boundary may pass.
inline cv::Mat CoverageOf(cv::Size size,
                          const std::function<double(double, double)>& signed_distance) {
  cv::Mat coverage(size, CV_32F);
  constexpr int kSamples = 16;
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const double centre = signed_distance(x + 0.5, y + 0.5);
      if (std::abs(centre) > 0.8) {
        coverage.at<float>(y, x) = centre < 0 ? 1.f : 0.f;
        continue;
      }
      int inside = 0;
      for (int j = 0; j < kSamples; ++j) {
        for (int i = 0; i < kSamples; ++i) {
          inside += signed_distance(x + (i + 0.5) / kSamples, y + (j + 0.5) / kSamples) < 0;
        }
      }
      coverage.at<float>(y, x) = static_cast<float>(inside) / (kSamples * kSamples);
    }
  }
  return coverage;
}

inline cv::Mat ToBytes(const cv::Mat& coverage) {
  cv::Mat bytes;
  coverage.convertTo(bytes, CV_8U, 255);
  return bytes;
}

}  // namespace scan
