#include "drivers/base/intrinsics.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

namespace scan {

Eigen::Vector2d Distort(const Intrinsics& in, const Eigen::Vector2d& p, Eigen::Matrix2d* jacobian) {
  const double x = p.x(), y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (in.k1 + r2 * (in.k2 + r2 * in.k3));
  if (jacobian) {
    const double dradial_dr2 = in.k1 + r2 * (2 * in.k2 + r2 * 3 * in.k3);
    (*jacobian)(0, 0) = radial + 2 * x * x * dradial_dr2 + 2 * in.p1 * y + 6 * in.p2 * x;
    (*jacobian)(0, 1) = 2 * x * y * dradial_dr2 + 2 * in.p1 * x + 2 * in.p2 * y;
    (*jacobian)(1, 0) = 2 * x * y * dradial_dr2 + 2 * in.p1 * x + 2 * in.p2 * y;
    (*jacobian)(1, 1) = radial + 2 * y * y * dradial_dr2 + 6 * in.p1 * y + 2 * in.p2 * x;
  }
  return {x * radial + 2 * in.p1 * x * y + in.p2 * (r2 + 2 * x * x),
          y * radial + in.p1 * (r2 + 2 * y * y) + 2 * in.p2 * x * y};
}

Eigen::Vector2d Undistort(const Intrinsics& in, const Eigen::Vector2d& distorted) {
  Eigen::Vector2d p = distorted;
  if (!in.has_distortion()) return p;
  for (int iteration = 0; iteration < 30; ++iteration) {
    Eigen::Matrix2d jacobian;
    const Eigen::Vector2d residual = Distort(in, p, &jacobian) - distorted;
    if (residual.norm() < 1e-12 || std::abs(jacobian.determinant()) < 1e-9) break;
    p -= jacobian.inverse() * residual;
  }
  return p;
}

std::optional<Eigen::Vector2d> Project(const Intrinsics& in, const Eigen::Vector3d& x) {
  if (!(x.z() > 0)) return std::nullopt;
  Eigen::Vector2d p(x.x() / x.z(), x.y() / x.z());
  if (in.has_distortion()) {
    Eigen::Matrix2d jacobian;
    const Eigen::Vector2d distorted = Distort(in, p, &jacobian);
    if (jacobian.determinant() <= 0) return std::nullopt;
    p = distorted;
  }
  return Eigen::Vector2d(in.fl_x * p.x() + in.cx, in.fl_y * p.y() + in.cy);
}

Eigen::Vector3d RayOfPixel(const Intrinsics& in, const Eigen::Vector2d& pixel) {
  const Eigen::Vector2d distorted((pixel.x() - in.cx) / in.fl_x, (pixel.y() - in.cy) / in.fl_y);
  return Undistort(in, distorted).homogeneous();
}

Intrinsics Scaled(const Intrinsics& in, int w, int h) {
  Intrinsics out = in;
  const double sx = static_cast<double>(w) / in.w, sy = static_cast<double>(h) / in.h;
  out.w = w;
  out.h = h;
  out.fl_x *= sx;
  out.cx *= sx;
  out.fl_y *= sy;
  out.cy *= sy;
  return out;
}

}  // namespace scan
