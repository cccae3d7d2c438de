// The pinhole camera with OpenCV's distortion (k1 k2 p1 p2 k3).
#pragma once

#include <Eigen/Core>
#include <optional>

namespace scan {

// Lengths in pixels; pixel centres at (0.5, 0.5): cx, cy follow this convention (subtract 0.5 for
// OpenCV's own calls). Distortion coefficients act on normalised image coordinates.
struct Intrinsics {
  int w = 0, h = 0;
  double fl_x = 0, fl_y = 0, cx = 0, cy = 0;
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  bool has_distortion() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0 || k3 != 0; }
  friend bool operator==(const Intrinsics&, const Intrinsics&) = default;
};

// Prior standard deviations: focal length relative to itself, principal point in pixels.
struct IntrinsicsSigma {
  double fl_rel = 0.01;
  double c_px = 0;  // 0: 0.3 % of the width
};

// Distorted normalised coordinates of undistorted ones; `jacobian`, when given, receives
// d(distorted)/d(undistorted).
Eigen::Vector2d Distort(const Intrinsics& intrinsics, const Eigen::Vector2d& normalised,
                        Eigen::Matrix2d* jacobian = nullptr);

// The inverse of Distort by fixed-point iteration with Newton steps, to 1e-12.
Eigen::Vector2d Undistort(const Intrinsics& intrinsics, const Eigen::Vector2d& distorted);

// Pixel of a point in the camera frame (mm); nothing when it is not in front of the camera
// (z <= 0) or so far off the axis that the distortion folds over.
std::optional<Eigen::Vector2d> Project(const Intrinsics& intrinsics,
                                       const Eigen::Vector3d& in_camera);

// Direction (z = 1) in the camera frame of a pixel.
Eigen::Vector3d RayOfPixel(const Intrinsics& intrinsics, const Eigen::Vector2d& pixel);

// The same camera with the picture area-averaged to `w` x `h`.
Intrinsics Scaled(const Intrinsics& intrinsics, int w, int h);

}  // namespace scan
