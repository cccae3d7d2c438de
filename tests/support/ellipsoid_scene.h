// A shaded, patterned ellipsoid on a platter: a renderer for capture tests, without the
// reconstruction half. Small pictures only (one ray a pixel).
#pragma once

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <optional>

#include "drivers/station/true_state.h"

namespace scan {

// Model frame: centre (0, 0, 14) mm, half axes 10, 6, 12 mm; the platter is the disc z = 0 of
// radius 20 mm.
namespace ellipsoid_scene {

inline const Eigen::Vector3d kCentre(0, 0, 14);
inline const Eigen::Vector3d kHalfAxes(10, 6, 12);

// Distance along the ray in front of its origin, or nothing.
inline std::optional<double> HitEllipsoid(const Eigen::Vector3d& origin,
                                          const Eigen::Vector3d& direction) {
  const Eigen::Vector3d o = (origin - kCentre).cwiseQuotient(kHalfAxes);
  const Eigen::Vector3d d = direction.cwiseQuotient(kHalfAxes);
  const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - 1;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return std::nullopt;
  const double t = (-b - std::sqrt(discriminant)) / a;
  return t > 0 ? std::optional(t) : std::nullopt;
}

inline cv::Vec3b Shade(const Eigen::Vector3d& p, const Eigen::Vector3d& normal) {
  const double light = 0.35 + 0.65 * std::max(0.0, normal.dot(Eigen::Vector3d(0.4, -0.5, 0.77)));
  const double stripe = 0.6 + 0.4 * std::sin(0.9 * p.x()) * std::cos(0.7 * p.z() + 0.5 * p.y());
  const auto level = [&](double v) { return cv::saturate_cast<unsigned char>(v * light * stripe); };
  return {level(60), level(120), level(220)};
}

inline cv::Vec3b Background(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  const double t = -origin.z() / direction.z();
  const Eigen::Vector3d p = origin + t * direction;
  if (t > 0 && p.head<2>().norm() < 20) {
    const bool dark = (static_cast<int>(std::floor(p.x() / 5) + std::floor(p.y() / 5)) & 1) != 0;
    return dark ? cv::Vec3b(110, 110, 110) : cv::Vec3b(130, 130, 130);
  }
  return {225, 222, 220};
}

}  // namespace ellipsoid_scene

inline Result<cv::Mat> RenderEllipsoidScene(const TrueState& state) {
  namespace scene = ellipsoid_scene;
  cv::Mat picture(state.intrinsics.h, state.intrinsics.w, CV_8UC3);
  const auto model_from_camera = state.camera_from_model.inverse();
  const Eigen::Vector3d origin = model_from_camera.translation();
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      const Eigen::Vector3d direction =
          model_from_camera.rotation() * RayOfPixel(state.intrinsics, {x + 0.5, y + 0.5});
      cv::Vec3b colour = scene::Background(origin, direction);
      if (state.specimen_present)
        if (const auto t = scene::HitEllipsoid(origin, direction)) {
          const Eigen::Vector3d p = origin + *t * direction;
          const Eigen::Vector3d normal =
              (p - scene::kCentre).cwiseQuotient(scene::kHalfAxes.cwiseAbs2()).normalized();
          colour = scene::Shade(p, normal);
        }
      picture.at<cv::Vec3b>(y, x) = state.light_on ? colour : colour * 0.05;
    }
  }
  return picture;
}

}  // namespace scan
