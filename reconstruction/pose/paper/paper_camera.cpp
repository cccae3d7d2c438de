#include "reconstruction/pose/paper/paper_camera.h"

#include <algorithm>
#include <cmath>

namespace scan {
namespace {

Eigen::Matrix3d About(const Eigen::Vector3d& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

}  // namespace

CameraFromModel CameraFromModelOf(const PaperCamera& c, const Eigen::Vector3d& mass_centre) {
  const auto x = Eigen::Vector3d::UnitX(), y = Eigen::Vector3d::UnitY(),
             z = Eigen::Vector3d::UnitZ();
  // Ijiri 2018, Eq 1
  const Eigen::Matrix3d orbit = About(y, c.theta) * About(z, c.phi);
  const Eigen::Matrix3d turned =
      orbit * About(x, c.delta_x) * About(y, c.delta_y) * About(z, c.delta_z);
  const Eigen::Vector3d position = mass_centre + orbit * Eigen::Vector3d(c.r, 0, 0);
  const Eigen::Vector3d ray = turned * Eigen::Vector3d(-1, 0, 0);
  const Eigen::Vector3d up = turned * Eigen::Vector3d(0, 1, 0);
  Eigen::Matrix3d rotation;  // rows: right, down, forward
  rotation.row(0) = ray.cross(up).transpose();
  rotation.row(1) = -up.transpose();
  rotation.row(2) = ray.transpose();
  return CameraFromModel(rotation, -rotation * position);
}

PaperCamera LookFrom(const Eigen::Vector3d& direction, double r_mm) {
  return {std::atan2(-direction.z(), direction.x()),
          std::asin(std::clamp(direction.y(), -1.0, 1.0)),
          r_mm,
          0,
          0,
          0};
}

}  // namespace scan
