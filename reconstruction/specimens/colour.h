// Internal: small helpers to paint specimens in linear light.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace scan::specimens {

// From 8-bit sRGB as people read it off a picture (IEC 61966-2-1).
inline Eigen::Vector3d FromSrgb8(int r, int g, int b) {
  const auto linear = [](int value) {
    const double v = value / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return {linear(r), linear(g), linear(b)};
}

inline double SmoothStep(double low, double high, double v) {
  const double t = std::clamp((v - low) / (high - low), 0.0, 1.0);
  return t * t * (3 - 2 * t);
}

inline Eigen::Vector3d Mix(const Eigen::Vector3d& a, const Eigen::Vector3d& b, double t) {
  return a + t * (b - a);
}

inline Eigen::Vector3d Bounded(const Eigen::Vector3d& colour) {
  return colour.cwiseMax(0.0).cwiseMin(1.0);
}

}  // namespace scan::specimens
